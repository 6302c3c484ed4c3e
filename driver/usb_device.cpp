#include "driver/usb_device.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <span>
#include <tuple>

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate {

namespace {

const std::filesystem::path sysfs_devices = "/sys/bus/usb/devices";

/// A string of the device, from sysfs: the kernel has read it, so that the device is not opened.
std::string attribute(const std::string& port, const char* name) {
  std::ifstream file(sysfs_devices / port / name);
  std::string line;
  std::getline(file, line);
  return line;
}

UsbDevice describe(libusb_device* device, const libusb_device_descriptor& descriptor) {
  constexpr int deepest = 7;  // ports from the root, by USB 3.0
  std::array<std::uint8_t, deepest> ports{};
  const int depth = std::max(0, libusb_get_port_numbers(device, ports.data(), deepest));
  const int bus = libusb_get_bus_number(device);
  const std::string port =
      depth == 0
          ? fmt::format("usb{}", bus)
          : fmt::format("{}-{}", bus, fmt::join(std::span(ports.data(), std::size_t(depth)), "."));
  return {.device = {libusb_ref_device(device), libusb_unref_device},
          .bus = bus,
          .address = libusb_get_device_address(device),
          .vendor = descriptor.idVendor,
          .product = descriptor.idProduct,
          .port = port,
          .serial = attribute(port, "serial"),
          .manufacturer = attribute(port, "manufacturer"),
          .product_name = attribute(port, "product")};
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

std::string UsbDevice::node() const {
  return fmt::format("/dev/bus/usb/{:03}/{:03}", bus, address);
}

std::string UsbDevice::place() const {
  return fmt::format("USB device {:04x}:{:04x} at {}", vendor, product, port);
}

std::vector<UsbDevice> usb_devices(const UsbContext& context) {
  libusb_device** list = nullptr;
  const ssize_t count = libusb_get_device_list(context.get(), &list);
  if (count < 0) {
    throw Error(Fault::system, fmt::format("USB: the devices cannot be listed: {}",
                                           libusb_strerror(static_cast<int>(count))));
  }
  const std::unique_ptr<libusb_device*, void (*)(libusb_device**)> owner(
      list, [](libusb_device** devices) { libusb_free_device_list(devices, 1); });
  std::vector<UsbDevice> devices;
  for (libusb_device* device : std::span(list, static_cast<std::size_t>(count))) {
    libusb_device_descriptor descriptor{};
    if (libusb_get_device_descriptor(device, &descriptor) == LIBUSB_SUCCESS &&
        descriptor.bDeviceClass != LIBUSB_CLASS_HUB) {
      devices.push_back(describe(device, descriptor));
    }
  }
  std::ranges::sort(devices, {}, [](const UsbDevice& d) { return std::tuple(d.bus, d.address); });
  return devices;
}

std::string interface_driver(const UsbDevice& device, int interface) {
  // The 1 is the configuration: every supported board has one.
  const auto link = sysfs_devices / fmt::format("{}:1.{}", device.port, interface) / "driver";
  std::error_code none;
  return std::filesystem::read_symlink(link, none).filename().string();
}

}  // namespace palpate
