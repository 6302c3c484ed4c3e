#include "driver/usb_handle.hpp"

#include <utility>

#include <fmt/format.h>

#include "driver/usb_device.hpp"

namespace palpate {

namespace {

constexpr unsigned patience_ms = 1000;

/// Returns what a libusb call returned; throws Error where the call failed.
int checked(const UsbDevice& device, const std::string& what, int code) {
  if (code < 0) {
    throw usb_fault(device, what, code);
  }
  return code;
}

}  // namespace

UsbHandle::UsbHandle(UsbDevice device) : device_(std::move(device)) {
  libusb_device_handle* handle = nullptr;
  checked(device_, "cannot be opened", libusb_open(device_.device.get(), &handle));
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
  checked(device_, fmt::format("interface {} cannot be claimed", interface),
          libusb_claim_interface(handle_.get(), interface));
  claimed_.push_back(interface);
}

std::vector<std::uint8_t> UsbHandle::control_in(const ControlRequest& request,
                                                std::uint16_t length) {
  std::vector<std::uint8_t> reply(length);
  reply.resize(static_cast<std::size_t>(control(request, reply)));
  return reply;
}

void UsbHandle::control_out(const ControlRequest& request, std::span<const std::uint8_t> bytes) {
  std::vector<std::uint8_t> data(bytes.begin(), bytes.end());  // libusb takes no const bytes
  control(request, data);
}

int UsbHandle::control(const ControlRequest& request, std::span<std::uint8_t> bytes) {
  return checked(device_, fmt::format("request 0x{:02X}", request.request),
                 libusb_control_transfer(handle_.get(), request.type, request.request,
                                         request.value, request.index, bytes.data(),
                                         static_cast<std::uint16_t>(bytes.size()), patience_ms));
}

void UsbHandle::bulk_out(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) {
  std::vector<std::uint8_t> data(bytes.begin(), bytes.end());
  int sent = 0;
  checked(device_, fmt::format("sending to endpoint 0x{:02X}", endpoint),
          libusb_bulk_transfer(handle_.get(), endpoint, data.data(), static_cast<int>(data.size()),
                               &sent, patience_ms));
}

void UsbHandle::clear_halt(std::uint8_t endpoint) {
  checked(device_, fmt::format("clearing the stall of endpoint 0x{:02X}", endpoint),
          libusb_clear_halt(handle_.get(), endpoint));
}

}  // namespace palpate
