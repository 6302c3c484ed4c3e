#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "driver/serial_profile.hpp"

namespace palpate {

/// A file that the kernel gave.
class FileDescriptor {
 public:
  explicit FileDescriptor(int number) : number_(number) {}
  ~FileDescriptor();
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;

  int get() const { return number_; }

 private:
  int number_;
};

/// Why the device file of a port could not be opened with this errno, and the remedy.
std::string why_not_opened(const std::string& node, int code);

/// A serial port of the kernel's, such as /dev/ttyUSB0, opened for this program alone.
class SerialPort {
 public:
  /// Opens the port with these settings of the line. @throws Error naming the port and the remedy
  SerialPort(const std::string& node, const SerialLine& line);
  ~SerialPort();
  SerialPort(const SerialPort&) = delete;
  SerialPort& operator=(const SerialPort&) = delete;

  /// Forgets what came and was not read. @throws Error where the device is gone
  void flush();

  /// @throws Error where the device takes not all bytes
  void write(const std::vector<std::uint8_t>& bytes);

  /// Waits until bytes come or the device goes, or until `wake` is readable, which it returns.
  bool wait(const FileDescriptor& wake);

  /// Takes what came, up to the room in `buffer`: nothing where nothing came.
  /// @throws Error where the device is gone
  std::span<const std::uint8_t> read(std::span<std::uint8_t> buffer);

 private:
  [[noreturn]] void refuse(const std::string& what) const;

  std::string node_;
  FileDescriptor port_;
};

}  // namespace palpate
