#pragma once

#include <linux/usbdevice_fs.h>
#include <umockdev.h>

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace palpate {

using Bytes = std::vector<std::uint8_t>;

/// The USB of a test: /sys, /dev and udev as umockdev shows them to libusb in this process and in
/// those it starts.
class FakeUsb {
 public:
  FakeUsb();
  ~FakeUsb();
  FakeUsb(const FakeUsb&) = delete;
  FakeUsb& operator=(const FakeUsb&) = delete;

  UMockdevTestbed* testbed() const { return testbed_; }
  std::string root() const;

 private:
  UMockdevTestbed* testbed_;
};

/// A device behind Linux's usbfs: what the kernel and the hardware would answer to libusb's ioctls.
/// Its firmware is the function that answers control requests, and whoever sends packets.
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
  /// The bytes for the host, empty for a request from it (whose bytes come along); none = stall.
  /// Called from the thread that plays the kernel.
  using Firmware = std::function<std::optional<Bytes>(const Setup& setup, const Bytes& data)>;
  /// What a packet's turn on the bus ends with, as the kernel reports it in the status of a URB.
  enum class Fault { none, stall, overflow, protocol };

  /// @param configuration the configuration descriptor with all that follows it
  FakeUsbDevice(FakeUsb& usb, int address, int port, Identity identity, Bytes configuration,
                Firmware firmware);
  /// Sensors that have transfers under way have to be stopped before: nobody would end them.
  ~FakeUsbDevice();
  FakeUsbDevice(const FakeUsbDevice&) = delete;
  FakeUsbDevice& operator=(const FakeUsbDevice&) = delete;

  /// Appears on the bus again, `by` addresses further: a bus gives each device that is plugged in a
  /// new one, and the old one only after all 127 have had their turn (0).
  void plug(int by = 1);
  /// Disappears: the URBs under way fail, and whoever has it open has nothing any more, also once
  /// it is plugged in again.
  void unplug();

  /// Queues a packet of the bulk endpoint towards the host.
  void send_packet(Bytes bytes);
  /// Queues bytes as packets of 64 bytes, the last one short; empty where they are a multiple.
  void send_message(const Bytes& bytes);
  /// The next turn on the bus ends so. A stall stays until the halt is cleared.
  void send_fault(Fault fault, int times = 1);
  /// Every control request is refused by a stall, or never answered.
  void refuse_requests(bool refuse);
  void ignore_requests(bool ignore);
  /// Only root may open it, and nobody where the test is not run by root.
  void forbid();
  /// Another program has the interfaces.
  void occupy(bool occupied);
  /// A driver of the kernel has the interface, except while it is claimed.
  void bind_kernel_driver(int interface);

  // What the host has done.
  std::vector<Setup> requests() const;
  int halts_cleared() const;
  int urbs_under_way() const;
  bool claimed(int interface) const;
  bool has_kernel_driver(int interface) const;
  Bytes received() const;  ///< through the bulk endpoint from the host
  /// Packets that nobody has fetched yet.
  std::size_t waiting_packets() const;

  std::string node() const;
  std::string port() const;
  const Identity& identity() const { return identity_; }

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

  /// The device from one plugging in to the unplugging, which is what an open file belongs to: the
  /// kernel knows a device that comes back as another one.
  struct Attachment {
    explicit Attachment(FakeUsbDevice& device);
    ~Attachment();
    Attachment(const Attachment&) = delete;
    Attachment& operator=(const Attachment&) = delete;

    FakeUsbDevice& device;
    UMockdevIoctlBase* handler;
    bool plugged = true;
    bool halted = false;
    std::map<int, UMockdevIoctlClient*> claimed = {};  // by which open file
    std::deque<Urb> under_way = {};
    std::deque<Urb> finished = {};
  };

  static gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer attachment);
  void handle(UMockdevIoctlClient* client, Attachment& attachment);
  int take_interface(int interface, UMockdevIoctlClient* client, Attachment& attachment) const;
  int submit(UMockdevIoctlData* argument, Attachment& attachment);
  static int discard(UMockdevIoctlData* argument, Attachment& attachment);
  int reap(UMockdevIoctlData* argument, Attachment& attachment, std::unique_lock<std::mutex>& lock);
  void run_control(Urb& urb);
  void run_bulk(Attachment& attachment);
  Attachment& last() const { return *attachments_.back(); }
  std::string syspath() const;
  void show_driver(int interface, const std::string& driver);

  FakeUsb& usb_;
  int address_;
  int port_;
  Identity identity_;
  Bytes configuration_;
  Firmware firmware_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::unique_ptr<Attachment>> attachments_;  // those of before may still be open
  bool refusing_ = false;
  bool ignoring_ = false;
  bool occupied_ = false;
  std::set<int> kernel_bound_;
  std::deque<Turn> turns_;
  std::vector<Setup> requests_;
  int halts_cleared_ = 0;
  Bytes received_;
};

}  // namespace palpate
