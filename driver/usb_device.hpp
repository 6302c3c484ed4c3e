#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <libusb.h>

#include "driver/device.hpp"
#include "palpate/sensor.hpp"

namespace palpate {

/// A session with libusb.
class UsbContext {
 public:
  /// @throws Error
  UsbContext();

  libusb_context* get() const { return context_.get(); }

 private:
  struct Exit {
    void operator()(libusb_context* context) const { libusb_exit(context); }
  };
  std::unique_ptr<libusb_context, Exit> context_;
};

/// An opened device. Every call waits for the device, at most 1 s, and throws Error if it fails. A
/// call may run callbacks of other transfers; do not make it from a callback.
class UsbHandle {
 public:
  UsbHandle(const UsbContext& context, ListedDevice device);
  ~UsbHandle();
  UsbHandle(const UsbHandle&) = delete;
  UsbHandle& operator=(const UsbHandle&) = delete;

  /// Claims the interface. A kernel driver that holds it is detached until the handle is destroyed.
  void claim(int interface);

  /// Sends the device a request that its vendor defines; returns the reply, at most `length` bytes.
  /// @throws Error where the device fails
  std::vector<std::uint8_t> control_in(std::uint8_t request, std::uint16_t length,
                                       std::uint16_t value = 0, std::uint16_t index = 0);

  const ListedDevice& device() const { return device_; }
  libusb_device_handle* get() const { return handle_.get(); }

 private:
  struct Close {
    void operator()(libusb_device_handle* handle) const { libusb_close(handle); }
  };

  ListedDevice device_;
  std::unique_ptr<libusb_device_handle, Close> handle_;
  std::vector<int> claimed_;
};

/// Bulk IN transfers that are always submitted, so that the bus never waits for the program. The
/// ring has no lock: use it only from the thread that handles the context's events.
///
/// A transfer that returns leaves its bytes in completed() and is submitted again at once, also
/// after a time-out or an error. A stall halts the ring until recover(); a lost device ends it.
class TransferRing {
 public:
  /// What one transfer brought.
  struct Completion {
    std::vector<std::uint8_t> bytes;
    double host_time_s = 0.0;  ///< when it returned, since the Unix epoch
    bool ended = false;        ///< whether a packet that was not full, perhaps empty, ended it
    /// Transfers since the previous completion whose bytes are lost: by an error or an overflow on
    /// the bus, or for want of memory.
    std::uint64_t missing = 0;
  };

  static constexpr std::size_t transfers = 16;

  /// @param transfer_bytes size of one transfer, a multiple of the endpoint's packet size
  /// @param counters counts time-outs, stalls and overflows; must outlive the ring
  /// @throws Error if the device takes no transfers
  TransferRing(const UsbContext& context, UsbHandle& handle, std::uint8_t endpoint,
               std::size_t transfer_bytes, SensorCounters& counters);
  ~TransferRing();
  TransferRing(const TransferRing&) = delete;
  TransferRing& operator=(const TransferRing&) = delete;

  /// Takes the transfers that returned since the last call, in order. The last completion may hold
  /// missing transfers alone.
  std::vector<Completion> completed();

  /// Whether a stall halted the endpoint; recover() ends the halt.
  bool halted() const { return halted_; }
  /// Whether the device is gone, or failed as often in a row as there are transfers.
  bool lost() const { return lost_; }

  /// Cancels all transfers, clears the halt and submits the transfers again. @throws Error
  void recover();
  /// Cancels all transfers and waits until every callback has returned.
  void drain();

 private:
  struct Free {
    void operator()(libusb_transfer* transfer) const { libusb_free_transfer(transfer); }
  };
  struct Slot {
    TransferRing* ring = nullptr;
    std::unique_ptr<libusb_transfer, Free> transfer;
    std::vector<std::uint8_t> buffer;
    bool under_way = false;
  };

  static void on_return(libusb_transfer* transfer) noexcept;
  void take(Slot& slot);
  void keep(Slot& slot, std::size_t length, bool ended) noexcept;
  void begin();
  int submit(Slot& slot);

  libusb_context* context_;
  UsbHandle& handle_;
  std::uint8_t endpoint_;
  std::size_t transfer_bytes_;
  std::vector<Slot> slots_;
  std::vector<Completion> completed_;
  std::uint64_t missing_ = 0;  // lost transfers since the last completion
  SensorCounters& counters_;
  std::size_t errors_in_a_row_ = 0;
  bool draining_ = false;
  bool halted_ = false;
  bool lost_ = false;
};

}  // namespace palpate
