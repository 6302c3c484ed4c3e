#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "driver/usb_device.hpp"

namespace palpate {

/// An interface with a bulk endpoint towards the host.
struct BulkInterface {
  int number = 0;
  std::uint8_t in_endpoint = 0;
  std::optional<std::uint8_t> out_endpoint = {};
  std::size_t packet_bytes = 0;  ///< the largest packet towards the host
};

/// Finds the first interface of this class that has a bulk endpoint towards the host. @throws Error
BulkInterface find_interface(const UsbDevice& device, std::uint8_t interface_class);

/// Finds the control interface of a CDC data interface by its union descriptor (CDC 1.2, 5.2.3.2);
/// without such a descriptor, the nearest control interface before the data interface, if any.
std::optional<int> find_control_interface(const UsbDevice& device, int data_interface);

}  // namespace palpate
