#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "deframer.hpp"

namespace palpate::takktile {

// The vendor requests of the published TakkTile-usb firmware; all are IN requests to the device,
// the stop and start of the stream included.
inline constexpr std::uint16_t vendor_id = 0x59e3;
inline constexpr std::uint16_t product_id = 0x74c7;
inline constexpr std::uint8_t request_type = 0xc0;
inline constexpr std::size_t packet_bytes = 64;

inline constexpr std::uint8_t request_alive_map = 0x5c;    ///< ask for alive_map_request_bytes
inline constexpr std::uint8_t request_calibration = 0x6c;  ///< wValue column, wIndex row
inline constexpr std::uint8_t request_stream = 0xc7;       ///< wValue ticks, wIndex 0: stop

inline constexpr std::size_t calibration_bytes = 8;
inline constexpr std::size_t stream_reply_bytes = 1;
/// The longer of the two replies, so that one request serves both firmwares.
inline constexpr std::size_t alive_map_request_bytes = 40;

/// The stream's period, wValue of request_stream, in ticks of 8 us.
inline constexpr std::uint16_t default_period_ticks = 120;

/// The grid of a board: up to 8 rows (I2C buses of strips) of 5 cells.
inline constexpr int rows = 8;
inline constexpr int columns = 5;

/// Distance of neighbouring cells along both axes, in mm. The firmware does not tell how the strips
/// are mounted: this takes the cells of a strip to lie 8 mm apart and the strips to lie side by
/// side at the same distance. Where a mounting differs, the recording's elements have to be
/// replaced.
inline constexpr double default_pitch_mm = 8.0;

/// Where a cell stands in the grid.
struct Cell {
  int row = 0;
  int column = 0;
  friend bool operator==(const Cell&, const Cell&) = default;
};

/// The cells that answer, row by row, in the order in which a frame carries them.
///
/// 8 bytes: byte = row, bit = column (TakkTile's firmware). 40 bytes: a byte per cell, row by row,
/// 0xff = alive (a fork's). @throws Error (Fault::system) for another length, a bit beyond the last
/// column, or no cell alive.
std::vector<Cell> parse_alive_map(std::span<const std::uint8_t> reply);

/// Centres in the sensor frame, in mm: columns along x, rows along y, the whole grid about the
/// origin, whatever of it is alive.
std::vector<glm::dvec2> element_positions(std::span<const Cell> cells,
                                          double pitch_mm = default_pitch_mm);

/// Coefficients of one cell's MPL115A2 (its data sheet, "Coefficients").
struct Calibration {
  double a0 = 0.0;   ///< pressure offset, in counts
  double b1 = 0.0;   ///< pressure sensitivity
  double b2 = 0.0;   ///< temperature coefficient of the offset
  double c12 = 0.0;  ///< temperature coefficient of the sensitivity
};

/// @throws Error (Fault::system) unless the reply has calibration_bytes, or where it is all zeros
/// or all ones, which is what a cell that does not answer gives.
Calibration parse_calibration(std::span<const std::uint8_t> reply);

/// Absolute pressure from the two 10-bit readings, in kPa: about 100 at rest, 50 to 115 at most by
/// the data sheet. A press is the rise above the value at rest.
double pressure_kpa(const Calibration& calibration, std::uint16_t raw_pressure,
                    std::uint16_t raw_temperature);

/// Frames of the bulk stream: 4 bytes per cell that is alive, ended by a packet of fewer than
/// packet_bytes, or an empty one where the frame is a multiple of them. One push is one packet.
class Deframer final : public palpate::Deframer {
 public:
  /// @param calibrations [cell] in the order of parse_alive_map
  explicit Deframer(std::vector<Calibration> calibrations);

  void push(std::span<const std::uint8_t> packet, std::vector<ParsedFrame>& frames) override;
  void reset() override;
  const DeframerCounters& counters() const override { return counters_; }

  /// Bytes of a frame.
  std::size_t frame_bytes() const { return 4 * calibrations_.size(); }

 private:
  std::vector<Calibration> calibrations_;
  std::vector<std::uint8_t> frame_;  // what has arrived of it
  bool whole_ = true;                // false: this frame holds too much, wait for its end
  DeframerCounters counters_;
};

}  // namespace palpate::takktile
