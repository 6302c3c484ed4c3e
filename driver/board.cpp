#include "driver/board.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "driver/serial_profile.hpp"
#include "driver/takktile_board.hpp"
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

}  // namespace

std::uint64_t Board::parse(const TransferRing::Completion& completion,
                           std::vector<ParsedFrame>& frames) {
  const std::uint64_t before = deframer().counters().checksum_errors;
  deframer().push(completion.bytes, frames);
  return deframer().counters().checksum_errors - before;
}

std::unique_ptr<Board> make_board(const std::string& name) {
  if (name == TakktileBoard::kind) {
    return std::make_unique<TakktileBoard>();
  }
  std::vector<std::string> known = shipped_profiles();
  if (!is_profile_path(name) && std::ranges::find(known, name) == known.end()) {
    known.insert(known.begin(), TakktileBoard::kind);
    throw Error(Fault::input,
                fmt::format("sensor '{}': no such board; give one of {}, or the path of a profile "
                            "that ends in .yaml",
                            name, fmt::join(known, ", ")));
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

}  // namespace palpate
