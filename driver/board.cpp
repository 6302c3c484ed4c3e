#include "driver/board.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "driver/serial_profile.hpp"
#include "driver/takktile_protocol.hpp"
#include "palpate/error.hpp"

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

/// A TakkTile: barometers under rubber, in strips of five, which answer USB vendor requests.
class TakktileBoard final : public Board {
 public:
  const std::string& name() const override { return takktile_kind; }

  bool fits(const UsbDevice& device) const override {
    return device.vendor == takktile::vendor_id && device.product == takktile::product_id;
  }

  StreamSource source(const UsbDevice& device) const override {
    const BulkInterface stream = find_interface(device, LIBUSB_CLASS_VENDOR_SPEC);
    return {.interfaces = {stream.number},
            .endpoint = stream.in_endpoint,
            .transfer_bytes = transfer_packets * takktile::packet_bytes};
  }

  SensorDescription configure(UsbHandle& handle) override {
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

  void start(UsbHandle& handle) override {
    handle.control_in(
        vendor_request(takktile::request_stream, takktile::default_period_ticks, start_index),
        takktile::stream_reply_bytes);
  }

  void stop(UsbHandle& handle) override {
    handle.control_in(vendor_request(takktile::request_stream, 0, stop_index),
                      takktile::stream_reply_bytes);
  }

  Deframer& deframer() override { return *deframer_; }
  std::uint64_t parse(const TransferRing::Completion& completion,
                      std::vector<ParsedFrame>& frames) override {
    const std::size_t before = frames.size();
    // The deframer takes single packets. A transfer that ended early behind full packets alone
    // ended with an empty packet.
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

 private:
  std::unique_ptr<takktile::Deframer> deframer_;
};

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

/// A board behind a USB serial port (CDC ACM) that a profile describes.
class SerialBoard final : public Board {
 public:
  SerialBoard(std::string name, SerialProfile profile)
      : name_(std::move(name)), profile_(std::move(profile)) {}

  const std::string& name() const override { return name_; }
  bool has_ids() const override { return !profile_.usb.empty(); }

  bool fits(const UsbDevice& device) const override {
    return std::ranges::find(profile_.usb, UsbId{device.vendor, device.product}) !=
           profile_.usb.end();
  }

  StreamSource source(const UsbDevice& device) const override {
    const BulkInterface data = data_interface(device);
    // A transfer returns when it is full or a short packet ends it. 2 ms of the line per transfer
    // keep the delay short, and let the ring buffer 32 ms while the program is busy.
    constexpr std::size_t bits_per_byte = 10;
    const std::size_t bytes = profile_.line.baud / bits_per_byte / 500;
    const std::size_t packets = std::clamp<std::size_t>(bytes / data.packet_bytes, 1, 64);
    StreamSource source{.endpoint = data.in_endpoint,
                        .transfer_bytes = packets * data.packet_bytes};
    if (const auto control = find_control_interface(device, data.number)) {
      source.interfaces.push_back(*control);
    }
    source.interfaces.push_back(data.number);
    return source;
  }

  SensorDescription configure(UsbHandle&) override {
    deframer_ = make_deframer(profile_);
    return {.name = profile_.name,
            .serial = {},
            .pressure_unit = profile_.pressure_unit,
            .elements_mm = profile_.elements_mm,
            .rate_hz = profile_.rate_hz};
  }

  void start(UsbHandle& handle) override {
    ask(handle, set_line_coding, 0, line_coding(profile_.line));
    ask(handle, set_control_line_state, terminal_ready_and_request_to_send);
    send(handle, profile_.start);
  }

  void stop(UsbHandle& handle) override {
    send(handle, profile_.stop);
    ask(handle, set_control_line_state, 0);
  }

  Deframer& deframer() override { return *deframer_; }

 private:
  void send(UsbHandle& handle, const std::vector<std::uint8_t>& bytes) {
    if (bytes.empty()) {
      return;
    }
    const BulkInterface data = data_interface(handle.device());
    if (!data.out_endpoint) {
      throw Error(
          Fault::system,
          fmt::format("{}: {} has bytes to send, but the device takes none; check that it is "
                      "the right board",
                      handle.device().place(), profile_.path.string()));
    }
    handle.bulk_out(*data.out_endpoint, bytes);
  }

  std::string name_;
  SerialProfile profile_;
  std::unique_ptr<Deframer> deframer_;
};

bool could_be(const UsbDevice& device, const Board& board) {
  return !board.has_ids() || board.fits(device);
}

}  // namespace

std::uint64_t Board::parse(const TransferRing::Completion& completion,
                           std::vector<ParsedFrame>& frames) {
  const std::uint64_t before = deframer().counters().checksum_errors;
  deframer().push(completion.bytes, frames);
  return deframer().counters().checksum_errors - before;
}

std::unique_ptr<Board> make_board(const std::string& name) {
  if (name == takktile_kind) {
    return std::make_unique<TakktileBoard>();
  }
  return std::make_unique<SerialBoard>(name, read_serial_profile(name));
}

std::vector<std::unique_ptr<Board>> known_boards() {
  std::vector<std::unique_ptr<Board>> boards;
  boards.push_back(std::make_unique<TakktileBoard>());
  for (const std::string& name : shipped_profiles()) {
    boards.push_back(make_board(name));
  }
  return boards;
}

BoardName parse_board_name(const std::string& name) {
  // A path may hold colons: the kind ends behind a profile's suffix, or else at the first colon.
  const std::string suffix = ".yaml";
  const std::size_t end = name.find(suffix + ":");
  const std::size_t colon = end != std::string::npos ? end + suffix.size()
                            : name.ends_with(suffix) ? std::string::npos
                                                     : name.find(':');
  BoardName parsed{.kind = name.substr(0, colon),
                   .which = colon == std::string::npos ? "" : name.substr(colon + 1)};
  if (parsed.kind.empty() || (colon != std::string::npos && parsed.which.empty())) {
    throw Error(Fault::input,
                fmt::format("sensor '{}': must be a board's name, or its name, a colon and its "
                            "serial number; see palpate sensors",
                            name));
  }
  return parsed;
}

std::string distinction(const Board& board, const UsbDevice& device,
                        const std::vector<UsbDevice>& devices) {
  const auto bearers = std::ranges::count_if(devices, [&](const UsbDevice& other) {
    return could_be(other, board) && other.serial == device.serial;
  });
  return device.serial.empty() || bearers > 1 ? device.port : device.serial;
}

std::string full_name(const Board& board, const UsbDevice& device,
                      const std::vector<UsbDevice>& devices) {
  return fmt::format("{}:{}", board.name(), distinction(board, device, devices));
}

UsbDevice choose_device(const std::vector<UsbDevice>& devices, const Board& board,
                        const std::string& which) {
  if (!board.has_ids() && which.empty()) {
    throw Error(
        Fault::input,
        fmt::format("sensor '{0}': its USB ids differ from maker to maker; say which device "
                    "it is by its serial number or port, as in {0}:1-2; see palpate sensors",
                    board.name()));
  }
  std::vector<UsbDevice> fitting;
  std::ranges::copy_if(devices, std::back_inserter(fitting), [&](const UsbDevice& device) {
    return could_be(device, board) &&
           (which.empty() || which == device.serial || which == device.port);
  });
  if (fitting.empty()) {
    throw Error(Fault::input, fmt::format("sensor '{}{}{}': not plugged in; see palpate sensors",
                                          board.name(), which.empty() ? "" : ":", which));
  }
  if (fitting.size() > 1) {
    std::vector<std::string> names;
    for (const UsbDevice& device : fitting) {
      names.push_back(full_name(board, device, devices));
    }
    throw Error(Fault::input,
                fmt::format("sensor '{}': {} such boards are plugged in; name one: {}",
                            board.name(), names.size(), fmt::join(names, ", ")));
  }
  return fitting.front();
}

}  // namespace palpate
