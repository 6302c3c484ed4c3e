#pragma once

#include <optional>
#include <string>

#include "fake_usb_device.hpp"

namespace palpate {

/// A pseudo-terminal: a serial port of the kernel's, whose far end the test holds. Throws, and so
/// fails the test with the reason, where the machine has none to give.
class FakePort {
 public:
  explicit FakePort(FakeUsb& usb);
  ~FakePort();
  FakePort(const FakePort&) = delete;
  FakePort& operator=(const FakePort&) = delete;

  const std::string& node() const { return node_; }
  /// Sends bytes to the host.
  void send(const Bytes& bytes) const;
  /// The next `count` bytes from the host, or fewer if fewer come in time.
  Bytes received(std::size_t count) const;
  /// Opens the port beside the host's program, before that does, for unread().
  void watch();
  /// Number of bytes that came to the host, which has not read them yet.
  int unread() const;
  unsigned baud() const;
  bool two_stop_bits() const;

 private:
  int far_ = -1;
  int near_ = -1;
  std::string node_;
};

/// A board behind a serial port of a USB device, as /sys and /dev show it.
class FakeSerialBoard {
 public:
  struct Ids {
    std::uint16_t vendor = 0x16d0;  // Robotiq's TSF-85
    std::uint16_t product = 0x14cc;
  };

  /// @param address also the number of its port and of its device file, /dev/ttyUSB2
  /// @param has_driver whether a driver of the kernel's makes a serial port of it
  FakeSerialBoard(FakeUsb& usb, const std::string& serial, Ids ids, int address = 2,
                  bool has_driver = true);
  ~FakeSerialBoard();
  FakeSerialBoard(const FakeSerialBoard&) = delete;
  FakeSerialBoard& operator=(const FakeSerialBoard&) = delete;

  /// Makes the board appear again, with another device file.
  void plug();
  /// Makes the board disappear: the port hangs up.
  void unplug();

  std::string node() const { return "/dev/" + tty_; }
  const FakePort& port() const { return *port_; }

 private:
  void show_port();
  std::string syspath() const;

  FakeUsb& usb_;
  FakeUsbDevice device_;
  int number_;
  std::string tty_;
  std::optional<FakePort> port_;
};

}  // namespace palpate
