#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "driver/usb_device.hpp"

namespace palpate {

/// The fields of a control request, by USB 2.0, table 9-2.
struct ControlRequest {
  std::uint8_t type = 0;  ///< bmRequestType; 0x80 = towards the host
  std::uint8_t request = 0;
  std::uint16_t value = 0;
  std::uint16_t index = 0;
};

/// An opened device. Every call waits for the device, at most 1 s, and throws Error if it fails. A
/// call may run callbacks of other transfers; do not make it from a callback.
class UsbHandle {
 public:
  explicit UsbHandle(UsbDevice device);
  ~UsbHandle();
  UsbHandle(const UsbHandle&) = delete;
  UsbHandle& operator=(const UsbHandle&) = delete;

  /// Claims the interface. A kernel driver that holds it is detached until the handle is destroyed.
  void claim(int interface);

  std::vector<std::uint8_t> control_in(const ControlRequest& request, std::uint16_t length);
  void control_out(const ControlRequest& request, std::span<const std::uint8_t> bytes = {});
  void bulk_out(std::uint8_t endpoint, std::span<const std::uint8_t> bytes);
  void clear_halt(std::uint8_t endpoint);

  const UsbDevice& device() const { return device_; }
  libusb_device_handle* get() const { return handle_.get(); }

 private:
  struct Close {
    void operator()(libusb_device_handle* handle) const { libusb_close(handle); }
  };
  int control(const ControlRequest& request, std::span<std::uint8_t> bytes);

  UsbDevice device_;
  std::unique_ptr<libusb_device_handle, Close> handle_;
  std::vector<int> claimed_;
};

}  // namespace palpate
