// What the kernel's usbfs answers to a program that has a fake device open.

#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstring>
#include <optional>
#include <utility>

#include "fake_usb_device.hpp"

namespace palpate {

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
