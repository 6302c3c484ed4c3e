#pragma once

#include <string>

#include "palpate/error.hpp"
#include "usb_device.hpp"

namespace palpate {

/// The error of a libusb call that returned `code`: what was tried at which device, why it failed,
/// and what helps. Permission that is missing names the udev rule and how to install it; an
/// interface in use names the program that has it, where /proc may be read.
Error usb_fault(const UsbDevice& device, const std::string& what, int code);

/// Why a program's claim keeps others from the device.
std::string in_use(const UsbDevice& device);

}  // namespace palpate
