#include "driver/usb_device.hpp"

#include <algorithm>
#include <new>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "model/stream_time.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

std::string missing_permission(const ListedDevice& device) {
  const std::string rules = (data_folder() / "70-palpate.rules").string();
  return fmt::format(
      "no permission to open {}; install the udev rule with 'sudo cp {} /etc/udev/rules.d/ && sudo "
      "udevadm control --reload && sudo udevadm trigger', then log in at this machine or join the "
      "group plugdev",
      device.node, rules);
}

std::string help(const ListedDevice& device, int code) {
  switch (code) {
    case LIBUSB_ERROR_ACCESS:
      return missing_permission(device);
    case LIBUSB_ERROR_BUSY:
      return in_use(device.node);
    case LIBUSB_ERROR_NO_DEVICE:
      return "it is unplugged; plug it in again";
    case LIBUSB_ERROR_PIPE:
      return "it refuses the request; check the board's firmware";
    case LIBUSB_ERROR_TIMEOUT:
      return "it does not answer; unplug it and plug it in again";
    default:
      return fmt::format("{}; unplug it and plug it in again", libusb_strerror(code));
  }
}

// For the answer to a request, and for the bytes of a transfer: of a silent board, transfers end
// and are counted.
constexpr unsigned patience_ms = 1000;

/// Returns what a libusb call returned. Throws Error where it failed: the message names the device,
/// what was tried, why it failed, and the remedy.
int checked(const ListedDevice& device, const std::string& what, int code) {
  if (code < 0) {
    throw Error(Fault::system, fmt::format("{}: {}: {}", device.place(), what, help(device, code)));
  }
  return code;
}

}  // namespace

UsbContext::UsbContext() {
  libusb_context* context = nullptr;
  const int code = libusb_init(&context);
  if (code != LIBUSB_SUCCESS) {
    throw Error(Fault::system,
                fmt::format("USB: {}; check that the machine has a USB controller and that "
                            "/dev/bus/usb is visible",
                            libusb_strerror(code)));
  }
  context_.reset(context);
}

UsbHandle::UsbHandle(const UsbContext& context, ListedDevice device) : device_(std::move(device)) {
  libusb_device** list = nullptr;
  const auto count = libusb_get_device_list(context.get(), &list);
  const std::unique_ptr<libusb_device*, void (*)(libusb_device**)> owner(
      list, [](libusb_device** devices) { libusb_free_device_list(devices, 1); });
  const std::span devices(list, static_cast<std::size_t>(std::max<ssize_t>(0, count)));
  const auto found = std::ranges::find_if(devices, [&](libusb_device* listed) {
    return libusb_get_bus_number(listed) == device_.bus &&
           libusb_get_device_address(listed) == device_.address;
  });
  libusb_device_handle* handle = nullptr;
  checked(device_, "cannot be opened",
          found == devices.end() ? int{LIBUSB_ERROR_NO_DEVICE} : libusb_open(*found, &handle));
  handle_.reset(handle);
  // Fails only on systems whose kernel drivers never hold an interface.
  libusb_set_auto_detach_kernel_driver(handle, 1);
}

UsbHandle::~UsbHandle() {
  for (const int interface : claimed_) {
    libusb_release_interface(handle_.get(), interface);
  }
}

void UsbHandle::claim(int interface) {
  checked(device_, fmt::format("interface {} cannot be claimed", interface),
          libusb_claim_interface(handle_.get(), interface));
  claimed_.push_back(interface);
}

std::vector<std::uint8_t> UsbHandle::control_in(std::uint8_t request, std::uint16_t length,
                                                std::uint16_t value, std::uint16_t index) {
  constexpr std::uint8_t from_vendor = 0xc0;  // USB 2.0, table 9-2: IN, vendor, to the device
  std::vector<std::uint8_t> reply(length);
  const int filled = checked(device_, fmt::format("request 0x{:02X}", request),
                             libusb_control_transfer(handle_.get(), from_vendor, request, value,
                                                     index, reply.data(), length, patience_ms));
  reply.resize(static_cast<std::size_t>(filled));
  return reply;
}

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
  checked(handle_.device(), fmt::format("clearing the stall of endpoint 0x{:02X}", endpoint_),
          libusb_clear_halt(handle_.get(), endpoint_));
  halted_ = false;
  begin();
}

void TransferRing::begin() {
  for (Slot& slot : slots_) {
    checked(handle_.device(), "no transfer can be submitted", submit(slot));
  }
}

int TransferRing::submit(Slot& slot) {
  libusb_fill_bulk_transfer(slot.transfer.get(), handle_.get(), endpoint_, slot.buffer.data(),
                            static_cast<int>(slot.buffer.size()), &TransferRing::on_return, &slot,
                            patience_ms);
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
