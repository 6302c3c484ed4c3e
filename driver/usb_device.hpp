#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <libusb.h>

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

/// What is known of a USB device without opening it. Must not outlive its context.
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

}  // namespace palpate
