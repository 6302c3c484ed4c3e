#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <libusb.h>

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

/// What is known of a USB device that is not opened. It must not outlive its context.
struct UsbDevice {
  std::shared_ptr<libusb_device> device;
  int bus = 0;
  int address = 0;
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::string port;          ///< where the device is plugged in: bus, then ports, such as "1-2.3"
  std::string serial;        ///< as the kernel read it; "" if the device has none
  std::string manufacturer;  ///< as the kernel read it; "" if the device has none
  std::string product_name;  ///< as the kernel read it; "" if the device has none

  /// The path of the device file.
  std::string node() const;
  /// The device's USB id and port, for messages.
  std::string place() const;
};

/// Lists every device except hubs, by bus and address. @throws Error
std::vector<UsbDevice> usb_devices(const UsbContext& context);

/// The kernel driver that holds the interface: "usbfs" if a program claimed it, "" for none.
std::string interface_driver(const UsbDevice& device, int interface);

/// The error of a libusb call that returned `code`. Its message names the device, what was tried,
/// why it failed, and the remedy: for missing permission, how to install the udev rule; for an
/// interface in use, the program to end, if /proc shows it.
Error usb_fault(const UsbDevice& device, const std::string& what, int code);

/// Says which program uses the device, and to end it.
std::string in_use(const UsbDevice& device);

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
