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

/// A device on the bus, as far as it is known without opening it. Must go before its context.
struct UsbDevice {
  std::shared_ptr<libusb_device> device;
  int bus = 0;
  int address = 0;
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::uint8_t device_class = 0;
  std::string port;    ///< where it is plugged in, such as "1-2.3": bus and ports
  std::string serial;  ///< as the kernel read it; "" where it has none; so below
  std::string manufacturer;
  std::string product_name;

  /// The file by which it is opened.
  std::string node() const;
  /// What messages call it.
  std::string place() const;
};

/// Every device except hubs, in the order of bus and address. @throws Error
std::vector<UsbDevice> usb_devices(const UsbContext& context);

/// The kernel driver that has the interface, "usbfs" for a program's, "" for none.
std::string interface_driver(const UsbDevice& device, int interface);

}  // namespace palpate
