#include "driver/takktile_link.hpp"

#include <span>

#include "palpate/error.hpp"

namespace palpate::takktile {

namespace {

// wIndex starts and stops the stream. The firmware ANDs it with the bits 0x06 of its timer's clock
// source: a wIndex of 1 would stop the timer.
constexpr std::uint16_t start_index = 0xff;
constexpr std::uint16_t stop_index = 0;

// A transfer is longer than any frame, so that a frame's short packet ends every transfer.
constexpr std::size_t transfer_packets = 8;
static_assert(transfer_packets * packet_bytes > 4 * rows * columns);

ControlRequest vendor_request(std::uint8_t request, std::uint16_t value = 0,
                              std::uint16_t index = 0) {
  return {.type = request_type, .request = request, .value = value, .index = index};
}

}  // namespace

Setup read_setup(UsbHandle& handle) {
  Setup setup;
  const std::vector<Cell> cells = parse_alive_map(
      handle.control_in(vendor_request(request_alive_map), alive_map_request_bytes));
  for (const Cell& cell : cells) {
    const auto request =
        vendor_request(request_calibration, static_cast<std::uint16_t>(cell.column),
                       static_cast<std::uint16_t>(cell.row));
    setup.calibrations.push_back(parse_calibration(handle.control_in(request, calibration_bytes)));
  }
  // The rate is unknown: the period begins only after all cells are read, which takes longer.
  setup.description = {.name = "TakkTile",
                       .serial = handle.device().serial,
                       .pressure_unit = "kPa",
                       .elements_mm = element_positions(cells)};
  return setup;
}

Link::Link(const UsbContext& context, const ListedDevice& device, TransferRing::Counters& counters)
    : context_(context),
      counters_(counters),
      handle_(context, device),
      stream_(handle_.vendor_interface()),
      setup_((handle_.claim(stream_.number), read_setup(handle_))),
      deframer_(setup_.calibrations) {}

void Link::begin() {
  deframer_.reset();
  // The ring must be ready before the board sends.
  ring_.emplace(context_, handle_, stream_.endpoint, transfer_packets * packet_bytes, counters_);
  try {
    handle_.control_in(vendor_request(request_stream, default_period_ticks, start_index),
                       stream_reply_bytes);
  } catch (...) {
    ring_.reset();
    throw;
  }
}

std::vector<TransferRing::Completion> Link::end() {
  try {
    handle_.control_in(vendor_request(request_stream, 0, stop_index), stream_reply_bytes);
  } catch (const Error&) {
    // The board may be unplugged; the transfers and interfaces are released either way.
  }
  ring_->drain();
  std::vector<TransferRing::Completion> last = ring_->completed();
  ring_.reset();
  return last;
}

std::uint64_t Link::parse(const TransferRing::Completion& completion,
                          std::vector<ParsedFrame>& frames) {
  const std::size_t before = frames.size();
  // The deframer takes single packets. A transfer that ended early behind full packets alone ended
  // with an empty packet.
  std::span<const std::uint8_t> rest = completion.bytes;
  while (rest.size() >= packet_bytes) {
    deframer_.push(rest.first(packet_bytes), frames);
    rest = rest.subspan(packet_bytes);
  }
  if (completion.ended || !rest.empty()) {
    deframer_.push(rest, frames);
  }
  // A transfer that ended without a frame had too few cells or too many.
  const bool spoiled = completion.ended && !completion.bytes.empty() && frames.size() == before;
  return spoiled ? 1 : 0;
}

}  // namespace palpate::takktile
