#include "usb_handle.hpp"

#include <utility>

#include <fmt/format.h>

#include "usb_fault.hpp"

namespace palpate {

namespace {
constexpr unsigned patience_ms = 1000;
}

UsbHandle::UsbHandle(UsbDevice device) : device_(std::move(device)) {
  libusb_device_handle* handle = nullptr;
  const int code = libusb_open(device_.device.get(), &handle);
  if (code != LIBUSB_SUCCESS) {
    throw usb_fault(device_, "cannot be opened", code);
  }
  handle_.reset(handle);
  // Fails only on systems whose kernel drivers never hold an interface.
  libusb_set_auto_detach_kernel_driver(handle, 1);
}

UsbHandle::~UsbHandle() {
  // In reverse order: the kernel's serial driver attaches again when the control interface, which
  // was claimed first, is released, and needs the data interface to be free by then.
  for (auto interface = claimed_.rbegin(); interface != claimed_.rend(); ++interface) {
    libusb_release_interface(handle_.get(), *interface);
  }
}

void UsbHandle::claim(int interface) {
  const int code = libusb_claim_interface(handle_.get(), interface);
  if (code != LIBUSB_SUCCESS) {
    throw usb_fault(device_, fmt::format("interface {} cannot be claimed", interface), code);
  }
  claimed_.push_back(interface);
}

std::vector<std::uint8_t> UsbHandle::control_in(const ControlRequest& request,
                                                std::uint16_t length) {
  std::vector<std::uint8_t> reply(length);
  const int got =
      libusb_control_transfer(handle_.get(), request.type, request.request, request.value,
                              request.index, reply.data(), length, patience_ms);
  if (got < 0) {
    throw usb_fault(device_, fmt::format("request 0x{:02X}", request.request), got);
  }
  reply.resize(static_cast<std::size_t>(got));
  return reply;
}

void UsbHandle::control_out(const ControlRequest& request, std::span<const std::uint8_t> bytes) {
  std::vector<std::uint8_t> data(bytes.begin(), bytes.end());  // libusb takes no const bytes
  const int code = libusb_control_transfer(handle_.get(), request.type, request.request,
                                           request.value, request.index, data.data(),
                                           static_cast<std::uint16_t>(data.size()), patience_ms);
  if (code < 0) {
    throw usb_fault(device_, fmt::format("request 0x{:02X}", request.request), code);
  }
}

void UsbHandle::bulk_out(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) {
  std::vector<std::uint8_t> data(bytes.begin(), bytes.end());
  int sent = 0;
  const int code = libusb_bulk_transfer(handle_.get(), endpoint, data.data(),
                                        static_cast<int>(data.size()), &sent, patience_ms);
  if (code != LIBUSB_SUCCESS) {
    throw usb_fault(device_, fmt::format("sending to endpoint 0x{:02X}", endpoint), code);
  }
}

void UsbHandle::clear_halt(std::uint8_t endpoint) {
  const int code = libusb_clear_halt(handle_.get(), endpoint);
  if (code != LIBUSB_SUCCESS) {
    throw usb_fault(device_, fmt::format("clearing the stall of endpoint 0x{:02X}", endpoint),
                    code);
  }
}

}  // namespace palpate
