#include "driver/usb_interfaces.hpp"

#include <algorithm>
#include <memory>
#include <span>
#include <vector>

#include <fmt/format.h>

#include "driver/usb_fault.hpp"

namespace palpate {

namespace {

using Configuration =
    std::unique_ptr<libusb_config_descriptor, void (*)(libusb_config_descriptor*)>;

Configuration configuration_of(const UsbDevice& device) {
  libusb_config_descriptor* descriptor = nullptr;
  const int code = libusb_get_active_config_descriptor(device.device.get(), &descriptor);
  if (code != LIBUSB_SUCCESS) {
    throw usb_fault(device, "its configuration cannot be read", code);
  }
  return {descriptor, libusb_free_config_descriptor};
}

/// The interfaces in their first alternate setting, which is the active one.
std::vector<const libusb_interface_descriptor*> interfaces_of(const Configuration& configuration) {
  std::vector<const libusb_interface_descriptor*> interfaces;
  for (const libusb_interface& i :
       std::span(configuration->interface, configuration->bNumInterfaces)) {
    if (i.num_altsetting > 0) {
      interfaces.push_back(i.altsetting);
    }
  }
  return interfaces;
}

BulkInterface describe(const libusb_interface_descriptor& interface) {
  constexpr int packet_bits = 0x07ff;  // of wMaxPacketSize, USB 2.0, table 9-13
  BulkInterface found{.number = interface.bInterfaceNumber};
  for (const libusb_endpoint_descriptor& e :
       std::span(interface.endpoint, interface.bNumEndpoints)) {
    if ((e.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) != LIBUSB_TRANSFER_TYPE_BULK) {
      continue;
    }
    if ((e.bEndpointAddress & LIBUSB_ENDPOINT_IN) == 0) {
      found.out_endpoint = e.bEndpointAddress;
    } else if (found.packet_bytes == 0) {
      found.in_endpoint = e.bEndpointAddress;
      found.packet_bytes = e.wMaxPacketSize & packet_bits;
    }
  }
  return found;
}

/// Whether the control interface's union descriptor names the data interface as subordinate.
bool rules_over(const libusb_interface_descriptor& control, int data_interface) {
  constexpr std::uint8_t class_specific_interface = 0x24;
  constexpr std::uint8_t union_subtype = 0x06;
  // Descriptors follow one another, each beginning with its length.
  std::span<const std::uint8_t> rest(control.extra, static_cast<std::size_t>(control.extra_length));
  while (rest.size() >= 3 && rest[0] >= 3 && rest[0] <= rest.size()) {
    if (rest[1] == class_specific_interface && rest[2] == union_subtype) {
      // The fourth byte is the control interface itself.
      const auto subordinates = rest.first(rest[0]).subspan(std::min<std::size_t>(4, rest[0]));
      return std::ranges::find(subordinates, data_interface) != subordinates.end();
    }
    rest = rest.subspan(rest[0]);
  }
  return false;
}

}  // namespace

BulkInterface find_interface(const UsbDevice& device, std::uint8_t interface_class) {
  const Configuration configuration = configuration_of(device);
  for (const libusb_interface_descriptor* interface : interfaces_of(configuration)) {
    const BulkInterface found = describe(*interface);
    if (interface->bInterfaceClass == interface_class && found.packet_bytes > 0) {
      return found;
    }
  }
  throw Error(Fault::system,
              fmt::format("{}: has no interface of class 0x{:02X} with a bulk endpoint; check its "
                          "firmware",
                          device.place(), interface_class));
}

std::optional<int> find_control_interface(const UsbDevice& device, int data_interface) {
  const Configuration configuration = configuration_of(device);
  std::optional<int> before;
  for (const libusb_interface_descriptor* interface : interfaces_of(configuration)) {
    if (interface->bInterfaceClass != LIBUSB_CLASS_COMM) {
      continue;
    }
    if (rules_over(*interface, data_interface)) {
      return interface->bInterfaceNumber;
    }
    if (interface->bInterfaceNumber < data_interface) {
      before = interface->bInterfaceNumber;
    }
  }
  return before;
}

}  // namespace palpate
