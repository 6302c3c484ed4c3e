#include "fake_usb_device.hpp"

#include <sys/ioctl.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace palpate {

namespace {

constexpr const char* root_hub = "/devices/pci0000:00/usb1";

/// Lets the kernel answer.
gboolean leave(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer) {
  constexpr int unhandled = -100;  // UNHANDLED of umockdev's ioctl_tree.h
  umockdev_ioctl_client_complete(client, unhandled, 0);
  return TRUE;
}

/// USB 2.0, table 9-8.
Bytes device_descriptor(std::uint16_t vendor, std::uint16_t product, std::uint8_t device_class,
                        bool has_serial) {
  Bytes bytes = {18, 1, 0x00, 0x02, device_class, 0, 0, FakeUsbDevice::packet_bytes};
  for (const std::uint16_t word : {vendor, product, std::uint16_t{0x0100}}) {
    bytes.push_back(static_cast<std::uint8_t>(word));
    bytes.push_back(static_cast<std::uint8_t>(word >> 8));
  }
  const std::uint8_t serial = has_serial ? 3 : 0;
  bytes.insert(bytes.end(), {1, 2, serial, 1});  // manufacturer, product, serial number
  return bytes;
}

std::string usb_device_text(const std::string& path, int address, const Bytes& descriptors) {
  return fmt::format(
      "P: {0}\nN: bus/usb/001/{1:03}\nE: SUBSYSTEM=usb\nE: DRIVER=usb\nE: DEVTYPE=usb_device\n"
      "E: BUSNUM=001\nE: DEVNUM={1:03}\nE: DEVNAME=/dev/bus/usb/001/{1:03}\n"
      "A: bConfigurationValue=1\\n\nA: busnum=1\\n\nA: devnum={1}\\n\nA: speed=12\\n\n"
      "A: idVendor={2:04x}\\n\nA: idProduct={3:04x}\\n\nA: bDeviceClass={4:02x}\\n\n"
      "H: descriptors={5:02x}\n",
      path, address, descriptors[8] | descriptors[9] << 8, descriptors[10] | descriptors[11] << 8,
      descriptors[4], fmt::join(descriptors, ""));
}

}  // namespace

FakeUsb::FakeUsb() : testbed_(umockdev_testbed_new()), kernel_(umockdev_ioctl_base_new()) {
  g_signal_connect(kernel_, "handle-ioctl", G_CALLBACK(leave), nullptr);
  Bytes hub = device_descriptor(0x1d6b, 0x0002, /*device_class=*/9, /*has_serial=*/false);
  hub.insert(hub.end(), {9, 2, 25, 0, 1, 1, 0, 0xe0, 0});  // configuration of one interface
  hub.insert(hub.end(), {9, 4, 0, 0, 1, 9, 0, 0, 0});
  hub.insert(hub.end(), {7, 5, 0x81, 3, 4, 0, 12});
  add(usb_device_text(root_hub, 1, hub));
}

void FakeUsb::add(const std::string& description) {
  GError* error = nullptr;
  if (!umockdev_testbed_add_from_string(testbed_, description.c_str(), &error)) {
    throw std::runtime_error(error->message);
  }
}

void FakeUsb::attach(const std::string& node, UMockdevIoctlBase* handler) {
  GError* error = nullptr;
  if (!umockdev_testbed_attach_ioctl(testbed_, node.c_str(), handler, &error)) {
    throw std::runtime_error(error->message);
  }
}

void FakeUsb::pass_on(const std::string& node) {
  umockdev_testbed_detach_ioctl(testbed_, node.c_str(), nullptr);
  attach(node, kernel_);
}

FakeUsb::~FakeUsb() {
  g_object_unref(testbed_);
  g_object_unref(kernel_);
}

std::string FakeUsb::root() const {
  char* text = umockdev_testbed_get_root_dir(testbed_);
  const std::string root = text;
  g_free(text);
  return root;
}

FakeUsbDevice::FakeUsbDevice(FakeUsb& usb, int address, Identity identity, Bytes configuration,
                             Firmware firmware)
    : usb_(usb),
      address_(address),
      port_(address),
      identity_(std::move(identity)),
      configuration_(std::move(configuration)),
      firmware_(std::move(firmware)) {
  plug(0);
}

FakeUsbDevice::~FakeUsbDevice() { unplug(); }

FakeUsbDevice::Attachment::Attachment(FakeUsbDevice& owner)
    : device(owner), handler(umockdev_ioctl_base_new()) {
  g_signal_connect(handler, "handle-ioctl", G_CALLBACK(&FakeUsbDevice::on_ioctl), this);
}

FakeUsbDevice::Attachment::~Attachment() {
  g_signal_handlers_disconnect_by_data(handler, this);
  g_object_unref(handler);
}

std::string FakeUsbDevice::port() const { return fmt::format("1-{}", port_); }
std::string FakeUsbDevice::node() const { return fmt::format("/dev/bus/usb/001/{:03}", address_); }
std::string FakeUsbDevice::syspath() const { return fmt::format("{}/{}", root_hub, port()); }

void FakeUsbDevice::plug(int by) {
  address_ += by;
  {
    const std::lock_guard lock(mutex_);
    attachments_.push_back(std::make_unique<Attachment>(*this));
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
  // Comes before the device appears: a program that sees the device can open it.
  usb_.attach(node(), last().handler);
  usb_.add(text);
  usb_.add(
      fmt::format("P: {}/{}:1.0\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_interface\n", syspath(), port()));
}

void FakeUsbDevice::unplug() {
  {
    const std::lock_guard lock(mutex_);
    if (!last().plugged) {
      return;
    }
    last().plugged = false;
    for (Urb& urb : last().under_way) {
      urb.status = -ESHUTDOWN;
      last().finished.push_back(std::move(urb));
    }
    last().under_way.clear();
    last().claimed = false;
  }
  const std::string path = "/sys" + syspath();
  umockdev_testbed_remove_device(usb_.testbed(), fmt::format("{}/{}:1.0", path, port()).c_str());
  umockdev_testbed_uevent(usb_.testbed(), path.c_str(), "remove");
  umockdev_testbed_remove_device(usb_.testbed(), path.c_str());
  umockdev_testbed_detach_ioctl(usb_.testbed(), node().c_str(), nullptr);
}

void FakeUsbDevice::queue(const std::vector<Turn>& turns) {
  {
    const std::lock_guard lock(mutex_);
    turns_.insert(turns_.end(), turns.begin(), turns.end());
  }
  changed_.notify_all();
}

void FakeUsbDevice::send(std::span<const std::uint8_t> bytes, bool end) {
  std::vector<Turn> turns;
  for (; bytes.size() >= packet_bytes; bytes = bytes.subspan(packet_bytes)) {
    turns.push_back({.packet = Bytes(bytes.begin(), bytes.begin() + packet_bytes)});
  }
  if (end) {
    turns.push_back({.packet = Bytes(bytes.begin(), bytes.end())});
  }
  queue(turns);
}

void FakeUsbDevice::send_fault(Fault fault, int times) {
  queue(std::vector<Turn>(static_cast<std::size_t>(times), {.packet = {}, .fault = fault}));
}

void FakeUsbDevice::behave(Manner manner) {
  const std::lock_guard lock(mutex_);
  manner_ = manner;
}

void FakeUsbDevice::occupy(bool occupied) {
  {
    const std::lock_guard lock(mutex_);
    occupied_ = occupied;
  }
  const std::string path = fmt::format("/sys{}/{}:1.0", syspath(), port());
  if (occupied) {
    umockdev_testbed_set_attribute_link(usb_.testbed(), path.c_str(), "driver",
                                        "../../../../../bus/usb/drivers/usbfs");
  } else {
    std::filesystem::remove(usb_.root() + path + "/driver");
  }
}

void FakeUsbDevice::forbid() {
  // Otherwise umockdev would ask its own socket before the file.
  umockdev_testbed_detach_ioctl(usb_.testbed(), node().c_str(), nullptr);
  chmod((usb_.root() + node()).c_str(), 0);
}

FakeUsbDevice::Seen FakeUsbDevice::seen() const {
  const std::lock_guard lock(mutex_);
  return {.requests = requests_,
          .halts_cleared = halts_cleared_,
          .urbs_under_way = last().under_way.size(),
          .waiting_packets = turns_.size(),
          .claimed = last().claimed};
}

// What follows answers the ioctls of a program that has the device open, as the kernel's usbfs
// would.

gboolean FakeUsbDevice::on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client,
                                 gpointer attachment) {
  auto& opened = *static_cast<Attachment*>(attachment);
  opened.device.handle(client, opened);
  return TRUE;
}

void FakeUsbDevice::handle(UMockdevIoctlClient* client, Attachment& attachment) {
  UMockdevIoctlData* argument = umockdev_ioctl_client_get_arg(client);
  std::unique_lock lock(mutex_);
  const unsigned long request = umockdev_ioctl_client_get_request(client);
  int code = 0;  // an errno
  if (!attachment.plugged && request != USBDEVFS_REAPURBNDELAY) {
    code = ENODEV;
  } else {
    switch (request) {
      case USBDEVFS_GET_CAPABILITIES: {
        constexpr std::uint32_t capabilities =
            USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_NO_PACKET_SIZE_LIM |
            USBDEVFS_CAP_BULK_CONTINUATION | USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
        const Memory memory(
            umockdev_ioctl_data_resolve(argument, 0, sizeof(capabilities), nullptr));
        std::memcpy(memory->data, &capabilities, sizeof(capabilities));
        break;
      }
      case USBDEVFS_GETDRIVER:
        code = ENODATA;
        break;
      case USBDEVFS_DISCONNECT_CLAIM:
      case USBDEVFS_CLAIMINTERFACE:
        attachment.claimed = !occupied_;
        code = occupied_ ? EBUSY : 0;
        break;
      case USBDEVFS_RELEASEINTERFACE:
        attachment.claimed = false;
        break;
      case USBDEVFS_CLEAR_HALT:
        attachment.halted = false;
        ++halts_cleared_;
        break;
      case USBDEVFS_SUBMITURB:
        code = submit(argument, attachment);
        break;
      case USBDEVFS_DISCARDURB:
        code = discard(argument, attachment);
        break;
      case USBDEVFS_REAPURBNDELAY:
        code = reap(argument, attachment, lock);
        break;
      case USBDEVFS_IOCTL:  // to give an interface back to the kernel's driver
        break;
      default:
        code = ENOTTY;
    }
  }
  umockdev_ioctl_client_complete(client, code == 0 ? 0 : -1, code);
}

int FakeUsbDevice::submit(UMockdevIoctlData* argument, Attachment& attachment) {
  Urb urb;
  urb.data.reset(umockdev_ioctl_data_resolve(argument, 0, sizeof(usbdevfs_urb), nullptr));
  const auto length = static_cast<std::size_t>(urb.fields().buffer_length);
  if (length > 0) {
    urb.buffer.reset(umockdev_ioctl_data_resolve(urb.data.get(), offsetof(usbdevfs_urb, buffer),
                                                 length, nullptr));
  }
  if (urb.fields().type == USBDEVFS_URB_TYPE_CONTROL) {
    run_control(urb);
    (manner_ == Manner::ignores ? attachment.under_way : attachment.finished)
        .push_back(std::move(urb));
  } else {
    attachment.under_way.push_back(std::move(urb));
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
  requests_.push_back(setup);
  const std::optional<Bytes> reply = manner_ == Manner::answers ? firmware_(setup) : std::nullopt;
  if (!reply) {
    urb.status = -EPIPE;
    return;
  }
  urb.filled = std::min(room, reply->size());
  std::memcpy(urb.buffer->data + setup_bytes, reply->data(), urb.filled);
}

int FakeUsbDevice::discard(UMockdevIoctlData* argument, Attachment& attachment) {
  gulong address = 0;
  std::memcpy(&address, argument->data, sizeof(address));
  for (auto urb = attachment.under_way.begin(); urb != attachment.under_way.end(); ++urb) {
    if (urb->data->client_addr == address) {
      urb->status = -ENOENT;
      attachment.finished.push_back(std::move(*urb));
      attachment.under_way.erase(urb);
      return 0;
    }
  }
  return EINVAL;
}

/// Lets packets take their turn until a packet ends a transfer.
void FakeUsbDevice::run_bulk(Attachment& attachment) {
  while (attachment.finished.empty() && (attachment.halted || !turns_.empty()) &&
         !attachment.under_way.empty() && attachment.plugged) {
    Urb& urb = attachment.under_way.front();
    Turn turn{.packet = {}, .fault = Fault::stall};
    if (!attachment.halted) {
      turn = std::move(turns_.front());
      turns_.pop_front();
      attachment.halted = turn.fault == Fault::stall;
    }
    const auto room = static_cast<std::size_t>(urb.fields().buffer_length) - urb.filled;
    urb.status = -static_cast<int>(turn.packet.size() > room ? Fault::overflow : turn.fault);
    if (urb.status == 0) {
      std::ranges::copy(turn.packet, urb.buffer->data + urb.filled);
      urb.filled += turn.packet.size();
      if (turn.packet.size() == packet_bytes && turn.packet.size() < room) {
        continue;
      }
    }
    attachment.finished.push_back(std::move(urb));
    attachment.under_way.pop_front();
  }
}

int FakeUsbDevice::reap(UMockdevIoctlData* argument, Attachment& attachment,
                        std::unique_lock<std::mutex>& lock) {
  run_bulk(attachment);
  if (attachment.finished.empty() && attachment.plugged) {
    // libusb sees a file that is always ready, and asks without pause: a short wait saves time.
    changed_.wait_for(lock, std::chrono::microseconds(500));
    run_bulk(attachment);
  }
  if (attachment.finished.empty()) {
    return attachment.plugged ? EAGAIN : ENODEV;
  }
  const Urb urb = std::move(attachment.finished.front());
  attachment.finished.pop_front();
  urb.fields().status = urb.status;
  urb.fields().actual_length = static_cast<int>(urb.filled);
  const Memory pointer(umockdev_ioctl_data_resolve(argument, 0, sizeof(void*), nullptr));
  umockdev_ioctl_data_set_ptr(pointer.get(), 0, urb.data.get());
  return 0;
}

}  // namespace palpate
