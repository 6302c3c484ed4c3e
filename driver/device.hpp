#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

/// Vendor and product of a USB device.
struct UsbId {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  friend bool operator==(const UsbId&, const UsbId&) = default;
};

/// What the kernel shows of a device that is not opened.
struct ListedDevice {
  std::string node;  ///< the device file: of the USB device, or of the serial port that it is
  int bus = 0;
  int address = 0;
  UsbId id;
  std::string port;          ///< where it is plugged in: bus, then ports, such as "1-2.3"
  std::string serial;        ///< "" if the device has none
  std::string manufacturer;  ///< "" if the device has none
  std::string product_name;  ///< "" if the device has none

  /// The device's USB id and port, for messages.
  std::string place() const;
};

/// Lists every USB device except hubs, by bus and address.
std::vector<ListedDevice> usb_devices();

/// Lists the serial ports of USB devices, by bus, address and device file, whichever driver of the
/// kernel has them: /dev/ttyACM0, /dev/ttyUSB0.
std::vector<ListedDevice> serial_ports();

/// Those of the devices that bear one of these ids.
std::vector<ListedDevice> with_id(std::vector<ListedDevice> devices, const std::vector<UsbId>& ids);

/// Whether a program has claimed an interface of the USB device.
bool is_claimed(const ListedDevice& device);

/// The programs other than this one that have the file open, as "name (process 123)", as far as
/// this user may see.
std::vector<std::string> holders(const std::string& node);

/// Says which program uses the device file, and to end it.
std::string in_use(const std::string& node);

/// The two parts of a board's name, such as "takktile:0012".
struct BoardName {
  std::string kind;   ///< "takktile", or the name or path of a profile
  std::string which;  ///< serial number, port or device file of one board out of several, or ""
};
/// Splits a name at the colon behind its kind. @throws Error (Fault::input) for an empty part
BoardName parse_board_name(const std::string& name);

/// What tells the device from `others`, which may list it, too: its serial number, or else its
/// port, or else its device file.
std::string distinction(const ListedDevice& device, const std::vector<ListedDevice>& others);

/// The one device out of `candidates`, the boards of this kind, whose serial number, port or device
/// file is `which`; "" fits every device. @throws Error (Fault::input) if none or several fit
ListedDevice choose_device(const std::vector<ListedDevice>& candidates, const std::string& kind,
                           const std::string& which);

/// The folder of the driver's data files, the udev rule and the profiles of serial boards:
/// share/palpate in the nearest folder above the file that holds this code, the shared library or a
/// program that links it statically. So it is found in the build tree and in a moved installation.
/// Where there is no such folder, it is the one that the library was configured to be installed to.
std::filesystem::path data_folder();

}  // namespace palpate
