#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "driver/device.hpp"
#include "palpate/sensor.hpp"

namespace palpate::takktile {

// The interface and the bulk endpoint towards the host of the published firmware, TakkTile-usb:
// firmware/Descriptors.c.
inline constexpr UsbId usb_id{.vendor = 0x59e3, .product = 0x74c7};
inline constexpr int usb_interface = 0;
inline constexpr std::uint8_t usb_endpoint = 0x81;
inline constexpr std::size_t packet_bytes = 64;

// Its vendor requests: firmware/main.c, and TakkTile.py for the calibration. All are IN requests to
// the device, also the request that starts and stops the stream.
inline constexpr std::uint8_t request_alive_map = 0x5c;    ///< ask for alive_map_request_bytes
inline constexpr std::uint8_t request_calibration = 0x6c;  ///< wValue column, wIndex row
inline constexpr std::uint8_t request_stream = 0xc7;       ///< wValue ticks, wIndex 0: stop

inline constexpr std::size_t calibration_bytes = 8;
inline constexpr std::size_t stream_reply_bytes = 1;
/// Length of the longer alive map, so that one request serves both firmwares.
inline constexpr std::size_t alive_map_request_bytes = 40;

/// The stream's period, wValue of request_stream, in ticks of 8 us.
inline constexpr std::uint16_t default_period_ticks = 120;

/// A board's grid: up to 8 rows (strips, each on an I2C bus of its own) of 5 cells.
inline constexpr int rows = 8;
inline constexpr int columns = 5;

/// Assumed distance of neighbouring cells along both axes, in mm: the firmware does not report how
/// the strips are mounted. For another mounting, replace the element positions of the recording.
inline constexpr double default_pitch_mm = 8.0;

/// A cell's place in the grid.
struct Cell {
  int row = 0;
  int column = 0;
  friend bool operator==(const Cell&, const Cell&) = default;
};

/// Lists the cells that answer, row by row, which is the order of their readings in a frame.
///
/// TakkTile's firmware replies 8 bytes: a byte per row, a bit per column. A fork's firmware replies
/// 40 bytes: a byte per cell, row by row, 0xff = alive. @throws Error (Fault::system) for another
/// length, a bit beyond the last column, or no cell alive.
std::vector<Cell> parse_alive_map(std::span<const std::uint8_t> reply);

/// Centres of the cells in the sensor frame, in mm: columns along x, rows along y. The origin is
/// the middle of the whole grid, dead cells included.
std::vector<glm::dvec2> element_positions(std::span<const Cell> cells);

/// Coefficients of one cell's barometer, an MPL115A2 (its data sheet, "Coefficients").
struct Calibration {
  double a0 = 0.0;   ///< pressure offset, in counts
  double b1 = 0.0;   ///< pressure sensitivity
  double b2 = 0.0;   ///< temperature coefficient of the offset
  double c12 = 0.0;  ///< temperature coefficient of the sensitivity
};

/// Decodes a reply to request_calibration. @throws Error (Fault::system) for another length than
/// calibration_bytes, or for all 0x00 or all 0xff, the reply of a cell that is not there.
Calibration parse_calibration(std::span<const std::uint8_t> reply);

/// Absolute pressure, in kPa, from a cell's two 10-bit readings: about 100 kPa at rest, 50 to
/// 115 kPa by the data sheet. A press is the rise above the value at rest.
double pressure_kpa(const Calibration& calibration, std::uint16_t raw_pressure,
                    std::uint16_t raw_temperature);

/// Decodes the bulk stream. A frame has 4 bytes per cell that is alive and ends with a packet of
/// fewer than packet_bytes, perhaps an empty packet.
class Deframer {
 public:
  /// @param calibrations [cell] in the order of parse_alive_map()
  /// @param garbage_bytes counts the bytes that belong to no frame; must outlive this object
  Deframer(std::vector<Calibration> calibrations, std::uint64_t& garbage_bytes);

  /// Takes the next bytes. Where they end a frame and its length is right, returns it.
  std::optional<Frame> push(std::span<const std::uint8_t> bytes, bool ended);
  void reset();

 private:
  std::vector<Calibration> calibrations_;
  std::uint64_t& garbage_bytes_;
  std::vector<std::uint8_t> frame_;  // the bytes of the frame in progress
  bool frame_fits_ = true;           // false: the frame is too long, and skipped up to its end
};

}  // namespace palpate::takktile
