#include "fake_serial_board.hpp"

namespace palpate {

namespace {

// Interfaces 0 and 1 are another function of the board and have no CDC union descriptor.
constexpr std::uint8_t control_interface = 2;
constexpr std::uint8_t data_interface = 3;

Bytes configuration(FakeSerialBoard::Union descriptor) {
  std::vector<Bytes> descriptors = {
      {9, 2, 0, 0, 4, 1, 0, 0x80, 50},  // four interfaces; the length follows below
      {9, 4, 0, 0, 1, 0x02, 2, 0, 0},   // a control interface without a union
      {7, 5, 0x84, 3, 8, 0, 16},
      {9, 4, 1, 0, 0, 0xff, 0, 0, 0},
      {9, 4, control_interface, 0, 1, 0x02, 2, 1, 0},
      {5, 0x24, 0x00, 0x10, 0x01},  // header
      {5, 0x24, 0x06, control_interface, data_interface},
      {7, 5, 0x82, 3, 8, 0, 16},
      {9, 4, data_interface, 0, 2, 0x0a, 0, 0, 0},
      {7, 5, 0x03, 2, 64, 0, 0},
      {7, 5, 0x83, 2, 64, 0x18, 0}};  // 64 bytes, and bits that mean nothing in a bulk endpoint
  if (descriptor == FakeSerialBoard::Union::missing) {
    descriptors.erase(descriptors.begin() + 6);
  } else if (descriptor == FakeSerialBoard::Union::alone) {
    descriptors.erase(descriptors.begin() + 1, descriptors.begin() + 8);
    descriptors[0][4] = 1;
    descriptors[1][2] = 0;
  }
  Bytes bytes;
  for (const Bytes& d : descriptors) {
    bytes.insert(bytes.end(), d.begin(), d.end());
  }
  bytes[2] = static_cast<std::uint8_t>(bytes.size());
  return bytes;
}

}  // namespace

FakeSerialBoard::FakeSerialBoard(FakeUsb& usb, const std::string& serial, Ids ids, Union descriptor,
                                 int address)
    : device_(usb, address, /*port=*/address,
              {.vendor = ids.vendor,
               .product = ids.product,
               .manufacturer = "Maker",
               .product_name = "Serial board",
               .serial = serial},
              configuration(descriptor),
              [this](const FakeUsbDevice::Setup& setup, const Bytes& data) {
                return answer(setup, data);
              }) {
  if (descriptor != Union::alone) {
    device_.bind_kernel_driver(control_interface);
    device_.bind_kernel_driver(data_interface);
  }
}

std::optional<Bytes> FakeSerialBoard::line_coding() const {
  const std::lock_guard lock(mutex_);
  return line_coding_;
}

std::optional<int> FakeSerialBoard::line_state() const {
  const std::lock_guard lock(mutex_);
  return line_state_;
}

std::optional<Bytes> FakeSerialBoard::answer(const FakeUsbDevice::Setup& setup, const Bytes& data) {
  const std::lock_guard lock(mutex_);
  if (setup.type != 0x21 || setup.index != control_interface) {
    return std::nullopt;
  }
  if (setup.request == 0x20 && data.size() == 7) {
    line_coding_ = data;
    return Bytes{};
  }
  if (setup.request == 0x22) {
    line_state_ = setup.value;
    return Bytes{};
  }
  return std::nullopt;
}

}  // namespace palpate
