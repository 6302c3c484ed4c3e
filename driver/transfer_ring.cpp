#include "driver/transfer_ring.hpp"

#include <algorithm>
#include <new>
#include <utility>

#include "model/stream_time.hpp"

namespace palpate {

namespace {

// Ends and counts the transfers of a silent board.
constexpr unsigned transfer_patience_ms = 1000;

}  // namespace

TransferRing::TransferRing(const UsbContext& context, UsbHandle& handle, std::uint8_t endpoint,
                           std::size_t transfer_bytes, SensorCounters& counters)
    : context_(context.get()),
      handle_(handle),
      endpoint_(endpoint),
      transfer_bytes_(transfer_bytes),
      slots_(transfers),
      counters_(counters) {
  for (Slot& slot : slots_) {
    slot.ring = this;
    slot.buffer.resize(transfer_bytes_);
    slot.transfer.reset(libusb_alloc_transfer(0));
    if (!slot.transfer) {
      throw std::bad_alloc();
    }
  }
  try {
    begin();
  } catch (...) {
    drain();
    throw;
  }
}

TransferRing::~TransferRing() { drain(); }

std::vector<TransferRing::Completion> TransferRing::completed() {
  if (missing_ > 0) {
    completed_.push_back({.bytes = {}, .missing = missing_});
    missing_ = 0;
  }
  return std::exchange(completed_, {});
}

void TransferRing::recover() {
  drain();
  handle_.clear_halt(endpoint_);
  halted_ = false;
  begin();
}

void TransferRing::begin() {
  for (Slot& slot : slots_) {
    if (const int code = submit(slot); code != LIBUSB_SUCCESS) {
      throw usb_fault(handle_.device(), "no transfer can be submitted", code);
    }
  }
}

int TransferRing::submit(Slot& slot) {
  libusb_fill_bulk_transfer(slot.transfer.get(), handle_.get(), endpoint_, slot.buffer.data(),
                            static_cast<int>(slot.buffer.size()), &TransferRing::on_return, &slot,
                            transfer_patience_ms);
  const int code = libusb_submit_transfer(slot.transfer.get());
  slot.under_way = code == LIBUSB_SUCCESS;
  // Any error loses the device: no callback would submit this transfer again.
  lost_ = lost_ || !slot.under_way;
  return code;
}

void TransferRing::on_return(libusb_transfer* transfer) noexcept {
  Slot& slot = *static_cast<Slot*>(transfer->user_data);
  slot.under_way = false;
  slot.ring->take(slot);
}

void TransferRing::take(Slot& slot) {
  const int status = slot.transfer->status;
  const bool damaged = status == LIBUSB_TRANSFER_ERROR || status == LIBUSB_TRANSFER_OVERFLOW;
  // A halted endpoint stalls all submitted transfers: count one stall.
  const bool stalled = status == LIBUSB_TRANSFER_STALL && !halted_;
  counters_.timeouts += status == LIBUSB_TRANSFER_TIMED_OUT ? 1 : 0;
  counters_.overflows += status == LIBUSB_TRANSFER_OVERFLOW ? 1 : 0;
  counters_.stalls += stalled ? 1 : 0;
  halted_ = halted_ || stalled;
  if (damaged || stalled) {
    ++errors_in_a_row_;
  } else if (status == LIBUSB_TRANSFER_COMPLETED) {
    errors_in_a_row_ = 0;
  }
  lost_ = lost_ || status == LIBUSB_TRANSFER_NO_DEVICE || errors_in_a_row_ >= transfers;

  // A transfer that timed out or was cancelled may hold bytes.
  const auto length = static_cast<std::size_t>(damaged ? 0 : slot.transfer->actual_length);
  const bool ended = status == LIBUSB_TRANSFER_COMPLETED && length < transfer_bytes_;
  missing_ += damaged ? 1 : 0;
  if (length > 0 || ended) {
    keep(slot, length, ended);
  }
  if (!draining_ && !halted_ && !lost_ && status != LIBUSB_TRANSFER_CANCELLED) {
    submit(slot);
  }
}

void TransferRing::keep(Slot& slot, std::size_t length, bool ended) noexcept {
  try {
    const auto begin = slot.buffer.begin();
    completed_.push_back({.bytes = {begin, begin + static_cast<std::ptrdiff_t>(length)},
                          .host_time_s = host_clock_s(),
                          .ended = ended,
                          .missing = missing_});
    missing_ = 0;
  } catch (const std::bad_alloc&) {
    ++missing_;  // the caller is libusb, C code: no exception may leave
  }
}

void TransferRing::drain() {
  draining_ = true;
  for (Slot& slot : slots_) {
    if (slot.under_way) {
      libusb_cancel_transfer(slot.transfer.get());
    }
  }
  while (std::ranges::any_of(slots_, &Slot::under_way)) {
    timeval patience{.tv_sec = 0, .tv_usec = 100'000};
    libusb_handle_events_timeout_completed(context_, &patience, nullptr);
  }
  draining_ = false;
}

}  // namespace palpate
