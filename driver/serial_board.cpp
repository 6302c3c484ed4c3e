#include "driver/serial_board.hpp"

#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "driver/usb_interfaces.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

// CDC PSTN 1.2, 6.3: class requests to the control interface.
constexpr std::uint8_t class_request_out = 0x21;
constexpr std::uint8_t set_line_coding = 0x20;
constexpr std::uint8_t set_control_line_state = 0x22;
constexpr std::uint16_t terminal_ready_and_request_to_send = 3;

BulkInterface data_interface(const UsbDevice& device) {
  return find_interface(device, LIBUSB_CLASS_DATA);
}

std::array<std::uint8_t, 7> line_coding(const SerialLine& line) {
  return {static_cast<std::uint8_t>(line.baud),
          static_cast<std::uint8_t>(line.baud >> 8),
          static_cast<std::uint8_t>(line.baud >> 16),
          static_cast<std::uint8_t>(line.baud >> 24),
          static_cast<std::uint8_t>(line.stop_bits == 2 ? 2 : 0),
          static_cast<std::uint8_t>(line.parity),
          line.data_bits};
}

/// Sends a request to the control interface, if there is one.
void ask(UsbHandle& handle, std::uint8_t request, std::uint16_t value,
         std::span<const std::uint8_t> bytes = {}) {
  const UsbDevice& device = handle.device();
  if (const auto control = find_control_interface(device, data_interface(device).number)) {
    handle.control_out({.type = class_request_out,
                        .request = request,
                        .value = value,
                        .index = static_cast<std::uint16_t>(*control)},
                       bytes);
  }
}

}  // namespace

SerialBoard::SerialBoard(std::string name, SerialProfile profile)
    : name_(std::move(name)), profile_(std::move(profile)) {}

bool SerialBoard::fits(const UsbDevice& device) const {
  return std::ranges::find(profile_.usb, UsbId{device.vendor, device.product}) !=
         profile_.usb.end();
}

StreamSource SerialBoard::source(const UsbDevice& device) const {
  const BulkInterface data = data_interface(device);
  // A transfer returns when it is full or a short packet ends it. 2 ms of the line per transfer
  // keep the delay short, and let the ring buffer 32 ms while the program is busy.
  constexpr std::size_t bits_per_byte = 10;
  const std::size_t bytes = profile_.line.baud / bits_per_byte / 500;
  const std::size_t packets = std::clamp<std::size_t>(bytes / data.packet_bytes, 1, 64);
  StreamSource source{.endpoint = data.in_endpoint, .transfer_bytes = packets * data.packet_bytes};
  if (const auto control = find_control_interface(device, data.number)) {
    source.interfaces.push_back(*control);
  }
  source.interfaces.push_back(data.number);
  return source;
}

SensorDescription SerialBoard::configure(UsbHandle&) {
  deframer_ = make_deframer(profile_);
  return {.name = profile_.name,
          .serial = {},
          .pressure_unit = profile_.pressure_unit,
          .elements_mm = profile_.elements_mm,
          .rate_hz = profile_.rate_hz};
}

void SerialBoard::start(UsbHandle& handle) {
  ask(handle, set_line_coding, 0, line_coding(profile_.line));
  ask(handle, set_control_line_state, terminal_ready_and_request_to_send);
  send(handle, profile_.start);
}

void SerialBoard::stop(UsbHandle& handle) {
  send(handle, profile_.stop);
  ask(handle, set_control_line_state, 0);
}

void SerialBoard::send(UsbHandle& handle, const std::vector<std::uint8_t>& bytes) {
  if (bytes.empty()) {
    return;
  }
  const BulkInterface data = data_interface(handle.device());
  if (!data.out_endpoint) {
    throw Error(Fault::system,
                fmt::format("{}: {} has bytes to send, but the device takes none; check that it is "
                            "the right board",
                            handle.device().place(), profile_.path.string()));
  }
  handle.bulk_out(*data.out_endpoint, bytes);
}

}  // namespace palpate
