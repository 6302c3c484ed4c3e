// Answers the ioctls of a program that has a fake device open, as the kernel's usbfs would.

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
