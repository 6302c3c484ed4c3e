#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fake_usb_device.hpp"

namespace palpate {

/// A board behind a CDC ACM port: a control interface and the data interface that belongs to it.
class FakeSerialBoard {
 public:
  struct Ids {
    std::uint16_t vendor = 0x16d0;  // Robotiq's TSF-85
    std::uint16_t product = 0x14cc;
  };
  /// How the descriptors show the control interface; `alone`: the board has no control interface.
  enum class Union { present, missing, alone };

  FakeSerialBoard(FakeUsb& usb, const std::string& serial, Ids ids,
                  Union descriptor = Union::present, int address = 2);

  /// The settings that the host made last; none before it made any.
  std::optional<Bytes> line_coding() const;
  std::optional<int> line_state() const;

  FakeUsbDevice& usb() { return device_; }

 private:
  std::optional<Bytes> answer(const FakeUsbDevice::Setup& setup, const Bytes& data);

  mutable std::mutex mutex_;
  std::optional<Bytes> line_coding_;
  std::optional<int> line_state_;
  FakeUsbDevice device_;  // last member: it calls functions that use the other members
};

}  // namespace palpate
