#pragma once

#include <linux/usbdevice_fs.h>
#include <umockdev.h>

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace palpate {

using Bytes = std::vector<std::uint8_t>;

/// The USB of a test: umockdev shows this /sys, /dev and udev to libusb in the test's process and
/// in the processes that it starts.
class FakeUsb {
 public:
  FakeUsb();
  ~FakeUsb();
  FakeUsb(const FakeUsb&) = delete;
  FakeUsb& operator=(const FakeUsb&) = delete;

  UMockdevTestbed* testbed() const { return testbed_; }
  /// Adds a device by its description, as umockdev-record writes it.
  void add(const std::string& description);
  /// Lets a handler, or the kernel, answer the ioctls of this device file.
  void attach(const std::string& node, UMockdevIoctlBase* handler);
  void pass_on(const std::string& node);
  std::string root() const;

 private:
  UMockdevTestbed* testbed_;
  UMockdevIoctlBase* kernel_;  // leaves every ioctl to the kernel
};

/// A USB device that answers libusb's ioctls as Linux's usbfs and the hardware would. Its firmware
/// is a function that answers control requests, and the test, which sends packets.
class FakeUsbDevice {
 public:
  static constexpr std::size_t packet_bytes = 64;  ///< of every endpoint

  struct Identity {
    std::uint16_t vendor = 0;
    std::uint16_t product = 0;
    std::string manufacturer;
    std::string product_name;
    std::string serial;  ///< "" = none
  };
  struct Setup {
    std::uint8_t type = 0;
    std::uint8_t request = 0;
    std::uint16_t value = 0;
    std::uint16_t index = 0;
  };
  struct Seen {
    std::vector<Setup> requests;
    int halts_cleared = 0;
    std::size_t urbs_under_way = 0;
    std::size_t waiting_packets = 0;  ///< that the host has not fetched yet
    bool claimed = false;
  };
  /// Answers a control request, from the thread that plays the kernel: with bytes for the host, or
  /// with nullopt for a stall.
  using Firmware = std::function<std::optional<Bytes>(const Setup& setup)>;
  enum class Manner { answers, refuses, ignores };
  /// How a packet's turn on the bus ends: minus the status of the URB.
  enum class Fault { none = 0, stall = EPIPE, overflow = EOVERFLOW, protocol = EPROTO };

  /// @param address also the number of its port
  /// @param configuration the configuration descriptor and the descriptors behind it
  FakeUsbDevice(FakeUsb& usb, int address, Identity identity, Bytes configuration,
                Firmware firmware);
  /// Sensors with submitted transfers must be stopped before: nobody would end the transfers.
  ~FakeUsbDevice();
  FakeUsbDevice(const FakeUsbDevice&) = delete;
  FakeUsbDevice& operator=(const FakeUsbDevice&) = delete;

  /// Makes the device appear again, `by` addresses further. A bus gives each new device the next
  /// address, so that the old address (0) comes back only after 127 devices.
  void plug(int by = 1);
  /// Makes the device disappear: submitted URBs fail, and files opened before stay dead, even after
  /// the device is plugged in again.
  void unplug();

  /// Queues bytes of the bulk endpoint towards the host, as packets of 64 bytes and, where they end
  /// here, a last, shorter packet, which may be empty.
  void send(std::span<const std::uint8_t> bytes, bool end = true);
  /// Makes the next turn on the bus end this way. A stall stays until the halt is cleared.
  void send_fault(Fault fault, int times = 1);
  /// Answers control requests, refuses each by a stall, or never answers one.
  void behave(Manner manner);
  /// Takes the permission to open the device from all; root obeys beside an OrdinaryUser.
  void forbid();
  /// Lets another program hold the interface.
  void occupy(bool occupied);

  /// What the host did.
  Seen seen() const;

  std::string node() const;
  std::string port() const;
  std::string syspath() const;

 private:
  struct Unref {
    void operator()(UMockdevIoctlData* data) const { umockdev_ioctl_data_unref(data); }
  };
  using Memory = std::unique_ptr<UMockdevIoctlData, Unref>;  // of the client, as it is seen here
  struct Urb {
    Memory data;
    Memory buffer;
    std::size_t filled = 0;
    int status = 0;

    usbdevfs_urb& fields() const { return *reinterpret_cast<usbdevfs_urb*>(data->data); }
  };
  struct Turn {
    Bytes packet;
    Fault fault = Fault::none;
  };

  /// The device between one plugging in and the next unplugging. An open file belongs to it: to the
  /// kernel, a device that comes back is a new device.
  struct Attachment {
    explicit Attachment(FakeUsbDevice& device);
    ~Attachment();
    Attachment(const Attachment&) = delete;
    Attachment& operator=(const Attachment&) = delete;

    FakeUsbDevice& device;
    UMockdevIoctlBase* handler;
    bool plugged = true;
    bool halted = false;
    bool claimed = false;
    std::deque<Urb> under_way = {};
    std::deque<Urb> finished = {};
  };

  static gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer attachment);
  void handle(UMockdevIoctlClient* client, Attachment& attachment);
  int submit(UMockdevIoctlData* argument, Attachment& attachment);
  static int discard(UMockdevIoctlData* argument, Attachment& attachment);
  int reap(UMockdevIoctlData* argument, Attachment& attachment, std::unique_lock<std::mutex>& lock);
  void run_control(Urb& urb);
  void run_bulk(Attachment& attachment);
  Attachment& last() const { return *attachments_.back(); }
  void queue(const std::vector<Turn>& turns);

  FakeUsb& usb_;
  int address_;
  int port_;
  Identity identity_;
  Bytes configuration_;
  Firmware firmware_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::unique_ptr<Attachment>> attachments_;  // earlier ones may still be open
  Manner manner_ = Manner::answers;
  bool occupied_ = false;
  std::deque<Turn> turns_;
  std::vector<Setup> requests_;
  int halts_cleared_ = 0;
};

}  // namespace palpate
