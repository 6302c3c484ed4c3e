#include "fake_usb_device.hpp"

#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

namespace palpate {

namespace {

constexpr std::size_t packet_bytes = 64;
constexpr const char* root_hub = "/devices/pci0000:00/usb1";

std::string hex(const Bytes& bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    text += fmt::format("{:02x}", byte);
  }
  return text;
}

/// USB 2.0, table 9-8.
Bytes device_descriptor(std::uint16_t vendor, std::uint16_t product, std::uint8_t device_class,
                        bool has_serial) {
  const auto low = [](int value) { return static_cast<std::uint8_t>(value); };
  return {18,
          1,
          0x00,
          0x02,  // USB 2.0
          device_class,
          0,
          0,
          packet_bytes,
          low(vendor),
          low(vendor >> 8),
          low(product),
          low(product >> 8),
          0x00,
          0x01,  // release
          1,
          2,  // manufacturer, product
          low(has_serial ? 3 : 0),
          1};
}

void add(UMockdevTestbed* testbed, const std::string& description) {
  GError* error = nullptr;
  if (!umockdev_testbed_add_from_string(testbed, description.c_str(), &error)) {
    throw std::runtime_error(error->message);
  }
}

std::string usb_device_text(const std::string& path, int address, const Bytes& descriptors) {
  return fmt::format(
      "P: {0}\nN: bus/usb/001/{1:03}\nE: SUBSYSTEM=usb\nE: DRIVER=usb\nE: DEVTYPE=usb_device\n"
      "E: BUSNUM=001\nE: DEVNUM={1:03}\nE: DEVNAME=/dev/bus/usb/001/{1:03}\n"
      "A: bConfigurationValue=1\\n\nA: busnum=1\\n\nA: devnum={1}\\n\nA: speed=12\\n\n"
      "H: descriptors={2}\n",
      path, address, hex(descriptors));
}

}  // namespace

FakeUsb::FakeUsb() : testbed_(umockdev_testbed_new()) {
  Bytes hub = device_descriptor(0x1d6b, 0x0002, /*device_class=*/9, /*has_serial=*/false);
  hub.insert(hub.end(), {9, 2, 25, 0, 1, 1, 0, 0xe0, 0});  // configuration of one interface
  hub.insert(hub.end(), {9, 4, 0, 0, 1, 9, 0, 0, 0});
  hub.insert(hub.end(), {7, 5, 0x81, 3, 4, 0, 12});
  add(testbed_, usb_device_text(root_hub, 1, hub));
}

FakeUsb::~FakeUsb() { g_object_unref(testbed_); }

std::string FakeUsb::root() const {
  char* text = umockdev_testbed_get_root_dir(testbed_);
  const std::string root = text;
  g_free(text);
  return root;
}

FakeUsbDevice::FakeUsbDevice(FakeUsb& usb, int address, int port, Identity identity,
                             Bytes configuration, Firmware firmware)
    : usb_(usb),
      address_(address),
      port_(port),
      identity_(std::move(identity)),
      configuration_(std::move(configuration)),
      firmware_(std::move(firmware)),
      handler_(umockdev_ioctl_base_new()) {
  g_signal_connect(handler_, "handle-ioctl", G_CALLBACK(&FakeUsbDevice::on_ioctl), this);
  plug();
}

FakeUsbDevice::~FakeUsbDevice() {
  unplug();
  g_signal_handlers_disconnect_by_data(handler_, this);
  g_object_unref(handler_);
}

std::string FakeUsbDevice::port() const { return fmt::format("1-{}", port_); }
std::string FakeUsbDevice::node() const { return fmt::format("/dev/bus/usb/001/{:03}", address_); }
std::string FakeUsbDevice::syspath() const { return fmt::format("{}/{}", root_hub, port()); }

void FakeUsbDevice::plug(int by) {
  address_ += by;
  {
    const std::lock_guard lock(mutex_);
    plugged_ = true;
    halted_ = false;
    turns_.clear();
  }
  Bytes descriptors = device_descriptor(identity_.vendor, identity_.product, /*device_class=*/0,
                                        !identity_.serial.empty());
  descriptors.insert(descriptors.end(), configuration_.begin(), configuration_.end());
  std::string text = usb_device_text(syspath(), address_, descriptors);
  const auto attribute = [&](const char* name, const std::string& value) {
    if (!value.empty()) {
      text += fmt::format("A: {}={}\\n\n", name, value);
    }
  };
  attribute("manufacturer", identity_.manufacturer);
  attribute("product", identity_.product_name);
  attribute("serial", identity_.serial);
  // Before the device appears, so that whoever sees it can open it.
  GError* error = nullptr;
  if (!umockdev_testbed_attach_ioctl(usb_.testbed(), node().c_str(), handler_, &error)) {
    throw std::runtime_error(error->message);
  }
  add(usb_.testbed(), text);
  for (int interface = 0; interface < configuration_.at(4); ++interface) {
    add(usb_.testbed(), fmt::format("P: {}/{}:1.{}\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_interface\n",
                                    syspath(), port(), interface));
  }
}

void FakeUsbDevice::unplug() {
  {
    const std::lock_guard lock(mutex_);
    if (!plugged_) {
      return;
    }
    plugged_ = false;
    for (Urb& urb : under_way_) {
      urb.status = -ESHUTDOWN;
      finished_.push_back(std::move(urb));
    }
    under_way_.clear();
    claimed_.clear();
  }
  const std::string path = "/sys" + syspath();
  for (int interface = 0; interface < configuration_.at(4); ++interface) {
    umockdev_testbed_remove_device(usb_.testbed(),
                                   fmt::format("{}/{}:1.{}", path, port(), interface).c_str());
  }
  umockdev_testbed_uevent(usb_.testbed(), path.c_str(), "remove");
  umockdev_testbed_remove_device(usb_.testbed(), path.c_str());
  umockdev_testbed_detach_ioctl(usb_.testbed(), node().c_str(), nullptr);
}

void FakeUsbDevice::send_packet(Bytes bytes) {
  {
    const std::lock_guard lock(mutex_);
    turns_.push_back({.packet = std::move(bytes)});
  }
  changed_.notify_all();
}

void FakeUsbDevice::send_message(const Bytes& bytes) {
  {
    const std::lock_guard lock(mutex_);
    std::size_t sent = 0;
    for (; sent + packet_bytes <= bytes.size(); sent += packet_bytes) {
      const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(sent);
      turns_.push_back({.packet = Bytes(begin, begin + packet_bytes)});
    }
    turns_.push_back(
        {.packet = Bytes(bytes.begin() + static_cast<std::ptrdiff_t>(sent), bytes.end())});
  }
  changed_.notify_all();
}

void FakeUsbDevice::send_fault(Fault fault, int times) {
  {
    const std::lock_guard lock(mutex_);
    turns_.insert(turns_.end(), static_cast<std::size_t>(times),
                  Turn{.packet = {}, .fault = fault});
  }
  changed_.notify_all();
}

void FakeUsbDevice::refuse_requests(bool refuse) {
  const std::lock_guard lock(mutex_);
  refusing_ = refuse;
}

void FakeUsbDevice::ignore_requests(bool ignore) {
  const std::lock_guard lock(mutex_);
  ignoring_ = ignore;
}

void FakeUsbDevice::show_driver(int interface, const std::string& driver) {
  const std::string path = fmt::format("/sys{}/{}:1.{}", syspath(), port(), interface);
  std::filesystem::remove(usb_.root() + path + "/driver");
  if (!driver.empty()) {
    umockdev_testbed_set_attribute_link(usb_.testbed(), path.c_str(), "driver",
                                        ("../../../../../bus/usb/drivers/" + driver).c_str());
  }
}

void FakeUsbDevice::occupy(bool occupied) {
  {
    const std::lock_guard lock(mutex_);
    occupied_ = occupied;
  }
  show_driver(0, occupied ? "usbfs" : "");
}

void FakeUsbDevice::forbid() {
  // umockdev would ask its own socket before the file.
  umockdev_testbed_detach_ioctl(usb_.testbed(), node().c_str(), nullptr);
  const bool is_root = geteuid() == 0;
  chmod((usb_.root() + node()).c_str(), is_root ? S_IRUSR | S_IWUSR : 0);
}

void FakeUsbDevice::bind_kernel_driver(int interface) {
  const std::lock_guard lock(mutex_);
  kernel_bound_.insert(interface);
}

std::vector<FakeUsbDevice::Setup> FakeUsbDevice::requests() const {
  const std::lock_guard lock(mutex_);
  return requests_;
}

int FakeUsbDevice::halts_cleared() const {
  const std::lock_guard lock(mutex_);
  return halts_cleared_;
}

int FakeUsbDevice::urbs_under_way() const {
  const std::lock_guard lock(mutex_);
  return static_cast<int>(under_way_.size());
}

bool FakeUsbDevice::claimed(int interface) const {
  const std::lock_guard lock(mutex_);
  return claimed_.contains(interface);
}

bool FakeUsbDevice::has_kernel_driver(int interface) const {
  const std::lock_guard lock(mutex_);
  return kernel_bound_.contains(interface) && !claimed_.contains(interface);
}

Bytes FakeUsbDevice::received() const {
  const std::lock_guard lock(mutex_);
  return received_;
}

std::size_t FakeUsbDevice::waiting_packets() const {
  const std::lock_guard lock(mutex_);
  return turns_.size();
}

gboolean FakeUsbDevice::on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
  static_cast<FakeUsbDevice*>(self)->handle(client);
  return TRUE;
}

void FakeUsbDevice::handle(UMockdevIoctlClient* client) {
  UMockdevIoctlData* argument = umockdev_ioctl_client_get_arg(client);
  const auto memory = [&](std::size_t bytes) {
    return Memory(umockdev_ioctl_data_resolve(argument, 0, bytes, nullptr));
  };
  const auto number = [&](std::size_t bytes) {
    unsigned value = 0;
    std::memcpy(&value, memory(bytes)->data, sizeof(value));
    return static_cast<int>(value);
  };
  std::unique_lock lock(mutex_);
  const unsigned long request = umockdev_ioctl_client_get_request(client);
  int code = 0;  // an errno
  if (!plugged_ && request != USBDEVFS_REAPURBNDELAY && request != USBDEVFS_DISCARDURB) {
    code = ENODEV;
  } else {
    switch (request) {
      case USBDEVFS_GET_CAPABILITIES: {
        const std::uint32_t capabilities =
            USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_NO_PACKET_SIZE_LIM |
            USBDEVFS_CAP_BULK_CONTINUATION | USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
        std::memcpy(memory(sizeof(capabilities))->data, &capabilities, sizeof(capabilities));
        break;
      }
      case USBDEVFS_GETDRIVER:
        code = ENODATA;
        break;
      case USBDEVFS_DISCONNECT_CLAIM:  // the interface's number comes first
        code = take_interface(number(sizeof(usbdevfs_disconnect_claim)));
        break;
      case USBDEVFS_CLAIMINTERFACE:
        code = take_interface(number(sizeof(unsigned)));
        break;
      case USBDEVFS_RELEASEINTERFACE:
        claimed_.erase(number(sizeof(unsigned)));
        break;
      case USBDEVFS_CLEAR_HALT:
        halted_ = false;
        ++halts_cleared_;
        break;
      case USBDEVFS_SUBMITURB:
        code = submit(argument);
        break;
      case USBDEVFS_DISCARDURB:
        code = discard(argument);
        break;
      case USBDEVFS_REAPURBNDELAY:
        code = reap(argument, lock);
        break;
      case USBDEVFS_IOCTL:  // to give an interface back to the kernel's driver
        break;
      default:
        code = ENOTTY;
    }
  }
  umockdev_ioctl_client_complete(client, code == 0 ? 0 : -1, code);
}

int FakeUsbDevice::take_interface(int interface) {
  if (occupied_) {
    return EBUSY;
  }
  claimed_.insert(interface);
  return 0;
}

int FakeUsbDevice::submit(UMockdevIoctlData* argument) {
  Urb urb;
  urb.data.reset(umockdev_ioctl_data_resolve(argument, 0, sizeof(usbdevfs_urb), nullptr));
  const auto length = static_cast<std::size_t>(urb.fields().buffer_length);
  if (length > 0) {
    urb.buffer.reset(umockdev_ioctl_data_resolve(urb.data.get(), offsetof(usbdevfs_urb, buffer),
                                                 length, nullptr));
  }
  if (urb.fields().type == USBDEVFS_URB_TYPE_CONTROL) {
    run_control(urb);
    (ignoring_ ? under_way_ : finished_).push_back(std::move(urb));
  } else if ((urb.fields().endpoint & 0x80) == 0) {
    received_.insert(received_.end(), urb.buffer->data, urb.buffer->data + length);
    urb.filled = length;
    finished_.push_back(std::move(urb));
  } else {
    under_way_.push_back(std::move(urb));
  }
  return 0;
}

void FakeUsbDevice::run_control(Urb& urb) {
  const std::uint8_t* bytes = urb.buffer->data;
  const auto word = [&](int at) {
    return static_cast<std::uint16_t>(bytes[at] | bytes[at + 1] << 8);
  };
  const Setup setup{.type = bytes[0], .request = bytes[1], .value = word(2), .index = word(4)};
  constexpr std::size_t setup_bytes = 8;
  const std::size_t room = word(6);
  const bool towards_host = (setup.type & 0x80) != 0;
  requests_.push_back(setup);
  const Bytes data =
      towards_host ? Bytes{} : Bytes(bytes + setup_bytes, bytes + setup_bytes + room);
  const std::optional<Bytes> reply = refusing_ || ignoring_ ? std::nullopt : firmware_(setup, data);
  if (!reply) {
    urb.status = -EPIPE;
    return;
  }
  urb.filled = towards_host ? std::min(room, reply->size()) : room;
  if (towards_host) {
    std::memcpy(urb.buffer->data + setup_bytes, reply->data(), urb.filled);
  }
}

int FakeUsbDevice::discard(UMockdevIoctlData* argument) {
  gulong address = 0;
  std::memcpy(&address, argument->data, sizeof(address));
  for (auto urb = under_way_.begin(); urb != under_way_.end(); ++urb) {
    if (urb->data->client_addr == address) {
      urb->status = -ENOENT;
      finished_.push_back(std::move(*urb));
      under_way_.erase(urb);
      return 0;
    }
  }
  return EINVAL;
}

/// Lets packets take their turn until one ends a transfer.
void FakeUsbDevice::run_bulk() {
  while (finished_.empty() && (halted_ || !turns_.empty()) && !under_way_.empty() && plugged_) {
    Urb& urb = under_way_.front();
    if (halted_) {
      urb.status = -EPIPE;
      finished_.push_back(std::move(urb));
      under_way_.pop_front();
      continue;
    }
    const Turn turn = std::move(turns_.front());
    turns_.pop_front();
    const auto room = static_cast<std::size_t>(urb.fields().buffer_length) - urb.filled;
    switch (turn.fault) {
      case Fault::stall:
        halted_ = true;
        urb.status = -EPIPE;
        break;
      case Fault::overflow:
        urb.status = -EOVERFLOW;
        break;
      case Fault::protocol:
        urb.status = -EPROTO;
        break;
      case Fault::none:
        if (turn.packet.size() > room) {
          urb.status = -EOVERFLOW;
          break;
        }
        if (!turn.packet.empty()) {
          std::memcpy(urb.buffer->data + urb.filled, turn.packet.data(), turn.packet.size());
        }
        urb.filled += turn.packet.size();
        if (turn.packet.size() == packet_bytes && turn.packet.size() < room) {
          continue;
        }
    }
    finished_.push_back(std::move(urb));
    under_way_.pop_front();
  }
}

int FakeUsbDevice::reap(UMockdevIoctlData* argument, std::unique_lock<std::mutex>& lock) {
  run_bulk();
  if (finished_.empty() && plugged_) {
    // libusb sees a file that is always ready and asks without end: a short wait here leaves the
    // processor to others.
    changed_.wait_for(lock, std::chrono::microseconds(500));
    run_bulk();
  }
  if (finished_.empty()) {
    return plugged_ ? EAGAIN : ENODEV;
  }
  const Urb urb = std::move(finished_.front());
  finished_.pop_front();
  urb.fields().status = urb.status;
  urb.fields().actual_length = static_cast<int>(urb.filled);
  const Memory pointer(umockdev_ioctl_data_resolve(argument, 0, sizeof(void*), nullptr));
  umockdev_ioctl_data_set_ptr(pointer.get(), 0, urb.data.get());
  return 0;
}

}  // namespace palpate
