#include "driver/takktile_board.hpp"

#include <algorithm>
#include <span>

#include "driver/usb_interfaces.hpp"

namespace palpate {

namespace {

// wIndex starts and stops the stream. The firmware ANDs it with the bits 0x06 of its timer's clock
// source: a wIndex of 1 would stop the timer.
constexpr std::uint16_t start_index = 0xff;
constexpr std::uint16_t stop_index = 0;

// A transfer is longer than any frame, so that a frame's short packet ends every transfer.
constexpr std::size_t transfer_packets = 8;
static_assert(transfer_packets * takktile::packet_bytes > 4 * takktile::rows * takktile::columns);

ControlRequest vendor_request(std::uint8_t request, std::uint16_t value = 0,
                              std::uint16_t index = 0) {
  return {.type = takktile::request_type, .request = request, .value = value, .index = index};
}

}  // namespace

bool TakktileBoard::fits(const UsbDevice& device) const {
  return device.vendor == takktile::vendor_id && device.product == takktile::product_id;
}

StreamSource TakktileBoard::source(const UsbDevice& device) const {
  const BulkInterface stream = find_interface(device, LIBUSB_CLASS_VENDOR_SPEC);
  return {.interfaces = {stream.number},
          .endpoint = stream.in_endpoint,
          .transfer_bytes = transfer_packets * takktile::packet_bytes};
}

SensorDescription TakktileBoard::configure(UsbHandle& handle) {
  const std::vector<takktile::Cell> cells = takktile::parse_alive_map(handle.control_in(
      vendor_request(takktile::request_alive_map), takktile::alive_map_request_bytes));
  std::vector<takktile::Calibration> calibrations;
  for (const takktile::Cell& cell : cells) {
    const auto request =
        vendor_request(takktile::request_calibration, static_cast<std::uint16_t>(cell.column),
                       static_cast<std::uint16_t>(cell.row));
    calibrations.push_back(
        takktile::parse_calibration(handle.control_in(request, takktile::calibration_bytes)));
  }
  deframer_ = std::make_unique<takktile::Deframer>(std::move(calibrations));
  // The rate is unknown: the period begins only after all cells are read, which takes longer.
  return {.name = "TakkTile",
          .serial = {},
          .pressure_unit = "kPa",
          .elements_mm = takktile::element_positions(cells)};
}

void TakktileBoard::start(UsbHandle& handle) {
  handle.control_in(
      vendor_request(takktile::request_stream, takktile::default_period_ticks, start_index),
      takktile::stream_reply_bytes);
}

void TakktileBoard::stop(UsbHandle& handle) {
  handle.control_in(vendor_request(takktile::request_stream, 0, stop_index),
                    takktile::stream_reply_bytes);
}

std::uint64_t TakktileBoard::parse(const TransferRing::Completion& completion,
                                   std::vector<ParsedFrame>& frames) {
  const std::size_t before = frames.size();
  // The deframer takes single packets. A transfer that ended early behind full packets alone ended
  // with an empty packet.
  std::span<const std::uint8_t> rest = completion.bytes;
  while (rest.size() >= takktile::packet_bytes) {
    deframer_->push(rest.first(takktile::packet_bytes), frames);
    rest = rest.subspan(takktile::packet_bytes);
  }
  if (completion.ended || !rest.empty()) {
    deframer_->push(rest, frames);
  }
  // A transfer that ended without a frame had too few cells or too many.
  const bool spoiled = completion.ended && !completion.bytes.empty() && frames.size() == before;
  return spoiled ? 1 : 0;
}

}  // namespace palpate
