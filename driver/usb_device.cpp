#include "driver/usb_device.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

#include "driver/data_folder.hpp"

namespace palpate {

namespace {

const std::filesystem::path sysfs_devices = "/sys/bus/usb/devices";

/// A string of the device, from sysfs: the kernel has read it, so that the device is not opened.
std::string attribute(const std::string& port, const char* name) {
  std::ifstream file(sysfs_devices / port / name);
  std::string line;
  std::getline(file, line);
  return line;
}

UsbDevice describe(libusb_device* device, const libusb_device_descriptor& descriptor) {
  constexpr int deepest = 7;  // ports from the root, by USB 3.0
  std::array<std::uint8_t, deepest> ports{};
  const int depth = std::max(0, libusb_get_port_numbers(device, ports.data(), deepest));
  const int bus = libusb_get_bus_number(device);
  const std::string port =
      depth == 0
          ? fmt::format("usb{}", bus)
          : fmt::format("{}-{}", bus, fmt::join(std::span(ports.data(), std::size_t(depth)), "."));
  return {.device = {libusb_ref_device(device), libusb_unref_device},
          .bus = bus,
          .address = libusb_get_device_address(device),
          .vendor = descriptor.idVendor,
          .product = descriptor.idProduct,
          .port = port,
          .serial = attribute(port, "serial"),
          .manufacturer = attribute(port, "manufacturer"),
          .product_name = attribute(port, "product")};
}

namespace fs = std::filesystem;

/// The folder's readable entries: processes may end meanwhile, or belong to other users.
std::vector<fs::path> entries_of(const fs::path& folder) {
  std::vector<fs::path> entries;
  std::error_code code;
  for (fs::directory_iterator entry(folder, code), end; !code && entry != end;
       entry.increment(code)) {
    entries.push_back(entry->path());
  }
  return entries;
}

bool holds(const fs::path& process, const std::string& node) {
  return std::ranges::any_of(entries_of(process / "fd"), [&](const fs::path& file) {
    std::error_code code;
    // Compare the end only: a container's /dev may lie elsewhere.
    return fs::read_symlink(file, code).string().ends_with(node);
  });
}

/// The programs that have the file open, as "name (process 123)".
std::vector<std::string> holders(const std::string& node) {
  std::vector<std::string> programs;
  for (const fs::path& process : entries_of("/proc")) {
    const std::string id = process.filename();
    if (id.find_first_not_of("0123456789") == std::string::npos && id != std::to_string(getpid()) &&
        holds(process, node)) {
      std::string name;
      std::ifstream comm(process / "comm");
      std::getline(comm, name);
      programs.push_back(fmt::format("{} (process {})", name, id));
    }
  }
  return programs;
}

std::string missing_permission(const UsbDevice& device) {
  const std::string rules = (data_folder() / "70-palpate.rules").string();
  return fmt::format(
      "no permission to open {}; install the udev rule with 'sudo cp {} /etc/udev/rules.d/ && sudo "
      "udevadm control --reload && sudo udevadm trigger', then log in at this machine or join the "
      "group plugdev",
      device.node(), rules);
}

std::string help(const UsbDevice& device, int code) {
  switch (code) {
    case LIBUSB_ERROR_ACCESS:
      return missing_permission(device);
    case LIBUSB_ERROR_BUSY:
      return in_use(device);
    case LIBUSB_ERROR_NO_DEVICE:
      return "it is unplugged; plug it in again";
    case LIBUSB_ERROR_PIPE:
      return "it refuses the request; check the board's firmware";
    case LIBUSB_ERROR_TIMEOUT:
      return "it does not answer; unplug it and plug it in again";
    default:
      return fmt::format("{}; unplug it and plug it in again", libusb_strerror(code));
  }
}

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

BulkInterface bulk_interface_of(const libusb_interface_descriptor& interface) {
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

constexpr unsigned patience_ms = 1000;

/// Returns what a libusb call returned; throws Error where the call failed.
int checked(const UsbDevice& device, const std::string& what, int code) {
  if (code < 0) {
    throw usb_fault(device, what, code);
  }
  return code;
}

}  // namespace

UsbContext::UsbContext() {
  libusb_context* context = nullptr;
  const int code = libusb_init(&context);
  if (code != LIBUSB_SUCCESS) {
    throw Error(Fault::system,
                fmt::format("USB: {}; check that the machine has a USB controller and that "
                            "/dev/bus/usb is visible",
                            libusb_strerror(code)));
  }
  context_.reset(context);
}

std::string UsbDevice::node() const {
  return fmt::format("/dev/bus/usb/{:03}/{:03}", bus, address);
}

std::string UsbDevice::place() const {
  return fmt::format("USB device {:04x}:{:04x} at {}", vendor, product, port);
}

std::vector<UsbDevice> usb_devices(const UsbContext& context) {
  libusb_device** list = nullptr;
  const ssize_t count = libusb_get_device_list(context.get(), &list);
  if (count < 0) {
    throw Error(Fault::system, fmt::format("USB: the devices cannot be listed: {}",
                                           libusb_strerror(static_cast<int>(count))));
  }
  const std::unique_ptr<libusb_device*, void (*)(libusb_device**)> owner(
      list, [](libusb_device** devices) { libusb_free_device_list(devices, 1); });
  std::vector<UsbDevice> devices;
  for (libusb_device* device : std::span(list, static_cast<std::size_t>(count))) {
    libusb_device_descriptor descriptor{};
    if (libusb_get_device_descriptor(device, &descriptor) == LIBUSB_SUCCESS &&
        descriptor.bDeviceClass != LIBUSB_CLASS_HUB) {
      devices.push_back(describe(device, descriptor));
    }
  }
  std::ranges::sort(devices, {}, [](const UsbDevice& d) { return std::tuple(d.bus, d.address); });
  return devices;
}

std::string interface_driver(const UsbDevice& device, int interface) {
  // The 1 is the configuration: every supported board has one.
  const auto link = sysfs_devices / fmt::format("{}:1.{}", device.port, interface) / "driver";
  std::error_code none;
  return std::filesystem::read_symlink(link, none).filename().string();
}

std::string in_use(const UsbDevice& device) {
  const std::vector<std::string> programs = holders(device.node());
  return programs.empty()
             ? "in use by another program, or opened twice by this program; end the other use"
             : fmt::format("in use by {}; end that program", fmt::join(programs, ", "));
}

Error usb_fault(const UsbDevice& device, const std::string& what, int code) {
  return {Fault::system, fmt::format("{}: {}: {}", device.place(), what, help(device, code))};
}

BulkInterface find_interface(const UsbDevice& device, std::uint8_t interface_class) {
  const Configuration configuration = configuration_of(device);
  for (const libusb_interface_descriptor* interface : interfaces_of(configuration)) {
    const BulkInterface found = bulk_interface_of(*interface);
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

UsbHandle::UsbHandle(UsbDevice device) : device_(std::move(device)) {
  libusb_device_handle* handle = nullptr;
  checked(device_, "cannot be opened", libusb_open(device_.device.get(), &handle));
  handle_.reset(handle);
  // Fails only on systems whose kernel drivers never hold an interface.
  libusb_set_auto_detach_kernel_driver(handle, 1);
}

UsbHandle::~UsbHandle() {
  // In reverse order: the kernel's serial driver attaches again when the control interface, which
  // was claimed first, is released, and needs the data interface to be free by then.
  for (auto interface = claimed_.rbegin(); interface != claimed_.rend(); ++interface) {
    libusb_release_interface(handle_.get(), *interface);
  }
}

void UsbHandle::claim(int interface) {
  checked(device_, fmt::format("interface {} cannot be claimed", interface),
          libusb_claim_interface(handle_.get(), interface));
  claimed_.push_back(interface);
}

std::vector<std::uint8_t> UsbHandle::control_in(const ControlRequest& request,
                                                std::uint16_t length) {
  std::vector<std::uint8_t> reply(length);
  reply.resize(static_cast<std::size_t>(control(request, reply)));
  return reply;
}

void UsbHandle::control_out(const ControlRequest& request, std::span<const std::uint8_t> bytes) {
  std::vector<std::uint8_t> data(bytes.begin(), bytes.end());  // libusb takes no const bytes
  control(request, data);
}

int UsbHandle::control(const ControlRequest& request, std::span<std::uint8_t> bytes) {
  return checked(device_, fmt::format("request 0x{:02X}", request.request),
                 libusb_control_transfer(handle_.get(), request.type, request.request,
                                         request.value, request.index, bytes.data(),
                                         static_cast<std::uint16_t>(bytes.size()), patience_ms));
}

void UsbHandle::bulk_out(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) {
  std::vector<std::uint8_t> data(bytes.begin(), bytes.end());
  int sent = 0;
  checked(device_, fmt::format("sending to endpoint 0x{:02X}", endpoint),
          libusb_bulk_transfer(handle_.get(), endpoint, data.data(), static_cast<int>(data.size()),
                               &sent, patience_ms));
}

void UsbHandle::clear_halt(std::uint8_t endpoint) {
  checked(device_, fmt::format("clearing the stall of endpoint 0x{:02X}", endpoint),
          libusb_clear_halt(handle_.get(), endpoint));
}

}  // namespace palpate
