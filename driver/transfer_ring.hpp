#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "usb_handle.hpp"

namespace palpate {

/// A ring of bulk transfers towards the host that are always under way, so that the bus never waits
/// for the program. Whoever pumps the events of the context owns the ring: it has no lock.
///
/// A transfer that comes back leaves its bytes in completed() and goes out again at once, also
/// after a time-out or an error; not after a stall, which only recover() can end, nor once the
/// device is gone.
class TransferRing {
 public:
  /// What one transfer brought.
  struct Completion {
    std::vector<std::uint8_t> bytes;
    double host_time_s = 0.0;  ///< since the Unix epoch
    bool ended = false;  ///< by a packet that was not full; an empty one leaves no other trace
    /// Transfers since the one before whose bytes are missing: an error or an overflow on the bus,
    /// or no memory to keep them.
    std::uint64_t missing = 0;
  };

  /// What went wrong, over all rings of a board.
  struct Counters {
    std::uint64_t timeouts = 0;
    std::uint64_t stalls = 0;
    std::uint64_t overflows = 0;
  };

  static constexpr std::size_t transfers = 16;

  /// @param transfer_bytes of one transfer, a multiple of the endpoint's packet
  /// @param counters has to outlive the ring
  /// @throws Error where the device takes no transfers
  TransferRing(const UsbContext& context, UsbHandle& handle, std::uint8_t endpoint,
               std::size_t transfer_bytes, Counters& counters);
  ~TransferRing();
  TransferRing(const TransferRing&) = delete;
  TransferRing& operator=(const TransferRing&) = delete;

  /// What came since the last call, in order; the last may stand for missing transfers alone. Give
  /// it back by recycle(): a callback allocates memory only where more comes than was given back.
  std::vector<Completion> completed();
  void recycle(std::vector<Completion>&& completions);

  /// The endpoint is halted: recover() has to be called.
  bool halted() const { return halted_; }
  /// The device is gone, or failed as many times in a row as there are transfers.
  bool lost() const { return lost_; }

  /// Takes all transfers back, clears the halt and begins anew. @throws Error
  void recover();
  /// Takes all transfers back: cancels, and waits until every callback has returned.
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
  std::uint64_t missing_ = 0;  // since the last of them
  std::vector<std::vector<std::uint8_t>> spare_;
  Counters& counters_;
  std::size_t errors_in_a_row_ = 0;
  bool draining_ = false;
  bool halted_ = false;
  bool lost_ = false;
};

}  // namespace palpate
