#pragma once

#include <string>

#include "driver/usb_device.hpp"
#include "palpate/error.hpp"

namespace palpate {

/// The error of a libusb call that returned `code`. Its message names the device, what was tried,
/// why it failed, and the remedy: for missing permission, how to install the udev rule; for an
/// interface in use, the program to end, if /proc shows it.
Error usb_fault(const UsbDevice& device, const std::string& what, int code);

/// Says which program uses the device, and to end it.
std::string in_use(const UsbDevice& device);

}  // namespace palpate
