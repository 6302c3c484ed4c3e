#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <libusb.h>

#include "driver/device.hpp"
#include "palpate/error.hpp"

namespace palpate {

/// A session with libusb.
class UsbContext {
 public:
  /// @throws Error
  UsbContext();

  libusb_context* get() const { return context_.get(); }

 private:
  struct Exit {
    void operator()(libusb_context* context) const { libusb_exit(context); }
  };
  std::unique_ptr<libusb_context, Exit> context_;
};

/// The error of a libusb call that returned `code`. Its message names the device, what was tried,
/// why it failed, and the remedy: for missing permission, how to install the udev rule; for an
/// interface in use, the program to end, if /proc shows it.
Error usb_fault(const ListedDevice& device, const std::string& what, int code);

/// An interface with a bulk endpoint towards the host.
struct VendorInterface {
  int number = 0;
  std::uint8_t endpoint = 0;
};

/// An opened device. Every call waits for the device, at most 1 s, and throws Error if it fails. A
/// call may run callbacks of other transfers; do not make it from a callback.
class UsbHandle {
 public:
  UsbHandle(const UsbContext& context, ListedDevice device);
  ~UsbHandle();
  UsbHandle(const UsbHandle&) = delete;
  UsbHandle& operator=(const UsbHandle&) = delete;

  /// Finds the first interface of the class of vendors that has a bulk endpoint towards the host.
  VendorInterface vendor_interface() const;

  /// Claims the interface. A kernel driver that holds it is detached until the handle is destroyed.
  void claim(int interface);

  /// Sends the device a request that its vendor defines; returns the reply, at most `length` bytes.
  /// @throws Error where the device fails
  std::vector<std::uint8_t> control_in(std::uint8_t request, std::uint16_t length,
                                       std::uint16_t value = 0, std::uint16_t index = 0);
  void clear_halt(std::uint8_t endpoint);

  const ListedDevice& device() const { return device_; }
  libusb_device_handle* get() const { return handle_.get(); }

 private:
  struct Close {
    void operator()(libusb_device_handle* handle) const { libusb_close(handle); }
  };

  ListedDevice device_;
  std::unique_ptr<libusb_device_handle, Close> handle_;
  std::vector<int> claimed_;
};

}  // namespace palpate
