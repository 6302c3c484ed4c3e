#include "driver/takktile_protocol.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate::takktile {

namespace {

[[noreturn]] void refuse(const std::string& message) {
  throw Error(Fault::system, "TakkTile: " + message);
}

std::int16_t signed_16(std::uint8_t high, std::uint8_t low) {
  return static_cast<std::int16_t>(static_cast<std::uint16_t>(high << 8 | low));
}

/// A 10-bit reading of the MPL115A2: left-aligned in two bytes.
std::uint16_t reading(std::uint8_t high, std::uint8_t low) {
  return static_cast<std::uint16_t>(high << 2 | low >> 6);
}

}  // namespace

std::vector<Cell> parse_alive_map(std::span<const std::uint8_t> reply) {
  std::vector<Cell> cells;
  if (reply.size() == rows) {
    for (int row = 0; row < rows; ++row) {
      const std::uint8_t bits = reply[static_cast<std::size_t>(row)];
      if (bits >> columns != 0) {
        refuse(
            fmt::format("alive map says 0x{:02x} for row {}, but a row has {} cells; plug the "
                        "board in again",
                        bits, row, columns));
      }
      for (int column = 0; column < columns; ++column) {
        if ((bits >> column & 1) != 0) {
          cells.push_back({row, column});
        }
      }
    }
  } else if (reply.size() == rows * columns) {
    for (int cell = 0; cell < rows * columns; ++cell) {
      if (reply[static_cast<std::size_t>(cell)] == 0xff) {
        cells.push_back({cell / columns, cell % columns});
      }
    }
  } else {
    refuse(fmt::format("alive map has {} bytes instead of {} or {}; check the board's firmware",
                       reply.size(), rows, rows * columns));
  }
  if (cells.empty()) {
    refuse("no cell answers; check the strips' cables");
  }
  return cells;
}

std::vector<glm::dvec2> element_positions(std::span<const Cell> cells) {
  std::vector<glm::dvec2> elements_mm;
  for (const Cell& cell : cells) {
    elements_mm.emplace_back((cell.column - (columns - 1) / 2.0) * default_pitch_mm,
                             (cell.row - (rows - 1) / 2.0) * default_pitch_mm);
  }
  return elements_mm;
}

Calibration parse_calibration(std::span<const std::uint8_t> reply) {
  if (reply.size() != calibration_bytes) {
    refuse(fmt::format("calibration has {} bytes instead of {}; check the board's firmware",
                       reply.size(), calibration_bytes));
  }
  const auto all = [&](std::uint8_t value) {
    return std::all_of(reply.begin(), reply.end(),
                       [=](std::uint8_t byte) { return byte == value; });
  };
  if (all(0x00) || all(0xff)) {
    refuse(fmt::format("calibration of a cell is all 0x{:02x}: no answer; check the strip's cable",
                       reply[0]));
  }
  // Scales by the data sheet's table: bits behind the binary point, and zeros padded in front.
  return {.a0 = signed_16(reply[0], reply[1]) / 8.0,         // 2^3
          .b1 = signed_16(reply[2], reply[3]) / 8192.0,      // 2^13
          .b2 = signed_16(reply[4], reply[5]) / 16384.0,     // 2^14
          .c12 = signed_16(reply[6], reply[7] & 0xfc) / 4.0  // 14 bits, left-aligned
                 / 4194304.0};                               // 2^22
}

double pressure_kpa(const Calibration& calibration, std::uint16_t raw_pressure,
                    std::uint16_t raw_temperature) {
  const double compensated = calibration.a0 +
                             (calibration.b1 + calibration.c12 * raw_temperature) * raw_pressure +
                             calibration.b2 * raw_temperature;
  return 50.0 + compensated * (115.0 - 50.0) / 1023.0;
}

Deframer::Deframer(std::vector<Calibration> calibrations, std::uint64_t& garbage_bytes)
    : calibrations_(std::move(calibrations)), garbage_bytes_(garbage_bytes) {}

void Deframer::reset() {
  frame_.clear();
  frame_fits_ = true;
}

std::optional<Frame> Deframer::push(std::span<const std::uint8_t> bytes, bool ended) {
  const std::size_t frame_bytes = 4 * calibrations_.size();
  if (frame_fits_ && frame_.size() + bytes.size() <= frame_bytes) {
    frame_.insert(frame_.end(), bytes.begin(), bytes.end());
  } else {
    // More bytes than a frame: an end was lost. Decoding starts again after the next end.
    garbage_bytes_ += frame_.size() + bytes.size();
    frame_.clear();
    frame_fits_ = false;
  }
  if (!ended) {
    return std::nullopt;
  }
  std::optional<Frame> frame;
  if (frame_.size() == frame_bytes) {
    frame.emplace();
    for (std::size_t cell = 0; cell < calibrations_.size(); ++cell) {
      const std::uint8_t* read = &frame_[4 * cell];
      frame->values.push_back(
          pressure_kpa(calibrations_[cell], reading(read[0], read[1]), reading(read[2], read[3])));
    }
  } else {
    garbage_bytes_ += frame_.size();
  }
  reset();
  return frame;
}

}  // namespace palpate::takktile
