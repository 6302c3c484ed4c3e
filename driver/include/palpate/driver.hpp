#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "palpate/api.hpp"
#include "palpate/sensor.hpp"

namespace palpate {

/// A USB device, and whether Palpate can read it.
struct BoardInfo {
  std::string name;  ///< what open_board() takes, such as "takktile:0012"; "" if not a known board
  int bus = 0;
  int address = 0;
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::string manufacturer;   ///< as the device reports it; "" if it reports none
  std::string product_name;   ///< as the device reports it; "" if it reports none
  std::string serial;         ///< as the device reports it; "" if it reports none
  std::string serial_port;    ///< its device file, such as "/dev/ttyUSB0"; "" if it has none
  std::size_t elements = 0;   ///< elements of a frame; 0 if unknown
  double rate_hz = 0.0;       ///< frames per second; 0 if unknown
  std::string pressure_unit;  ///< "kPa" or "raw"; "" if unknown
  bool usable = false;        ///< whether open_board() would succeed
  std::string reason;         ///< why it would not: unknown board, no permission, or in use
};

/// Lists every USB device except hubs, by bus and address. Reads the geometry of each TakkTile that
/// no program uses. Claims no interface and opens no serial port, so that running streams are not
/// disturbed.
PALPATE_API std::vector<BoardInfo> list_boards();

/// The profile file that open_board() would read for this name; none for "takktile".
/// @throws Error (Fault::input) if the name is malformed
PALPATE_API std::optional<std::filesystem::path> board_file(const std::string& name);

/// Opens a board and reads its geometry and calibration. Sensor::start() begins the stream.
///
/// @param name KIND or KIND:WHICH. KIND is "takktile", a shipped profile of a serial board
/// ("tsf85", "wts", "flexitac", "flexitac12", "anyskin"), or the path of a profile that ends in
/// .yaml. WHICH is the serial number or the port (such as 1-2.3) of one device, or of a serial
/// board the path of its device file (such as /dev/ttyUSB0); it is needed where several such boards
/// are plugged in and where the profile lists no USB id.
///
/// While a TakkTile is unplugged, a started sensor is gone(). When a board with the same serial
/// number is back (or, if no serial number tells boards apart, a board on the same port), the
/// sensor reads the calibration again and continues. When a serial board is unplugged, next()
/// throws Error (Fault::system) behind the last frame. start() accepts a board of either kind that
/// was unplugged since, but does not wait for it. Call the sensor from one thread; between start()
/// and stop(), the sensor reads its device in a thread of its own.
/// @throws Error (Fault::input) if the name is wrong or no such board is plugged in,
///         (Fault::system) if the board cannot be opened: no permission, in use, or no answer
PALPATE_API std::unique_ptr<Sensor> open_board(const std::string& name);

}  // namespace palpate
