#include "driver/usb_device.hpp"

#include <algorithm>
#include <span>
#include <utility>

#include <fmt/format.h>

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

constexpr unsigned patience_ms = 1000;

/// Returns what a libusb call returned; throws Error where the call failed.
int checked(const ListedDevice& device, const std::string& what, int code) {
  if (code < 0) {
    throw usb_fault(device, what, code);
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

Error usb_fault(const ListedDevice& device, const std::string& what, int code) {
  return {Fault::system, fmt::format("{}: {}: {}", device.place(), what, help(device, code))};
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

VendorInterface UsbHandle::vendor_interface() const {
  libusb_config_descriptor* descriptor = nullptr;
  checked(device_, "its configuration cannot be read",
          libusb_get_active_config_descriptor(libusb_get_device(handle_.get()), &descriptor));
  const std::unique_ptr<libusb_config_descriptor, void (*)(libusb_config_descriptor*)> owner(
      descriptor, libusb_free_config_descriptor);
  for (const libusb_interface& interface :
       std::span(descriptor->interface, descriptor->bNumInterfaces)) {
    // The first alternate setting is the active one.
    for (const libusb_interface_descriptor& setting :
         std::span(interface.altsetting, std::min(1, interface.num_altsetting))) {
      for (const libusb_endpoint_descriptor& e :
           std::span(setting.endpoint, setting.bNumEndpoints)) {
        if (setting.bInterfaceClass == LIBUSB_CLASS_VENDOR_SPEC &&
            (e.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) == LIBUSB_TRANSFER_TYPE_BULK &&
            (e.bEndpointAddress & LIBUSB_ENDPOINT_IN) != 0) {
          return {setting.bInterfaceNumber, e.bEndpointAddress};
        }
      }
    }
  }
  throw Error(Fault::system,
              fmt::format("{}: has no vendor's interface with a bulk endpoint; check its firmware",
                          device_.place()));
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

void UsbHandle::clear_halt(std::uint8_t endpoint) {
  checked(device_, fmt::format("clearing the stall of endpoint 0x{:02X}", endpoint),
          libusb_clear_halt(handle_.get(), endpoint));
}

}  // namespace palpate
