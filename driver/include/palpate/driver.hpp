#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "palpate/sensor.hpp"

namespace palpate {

/// A device on the USB, and what Palpate can do with it.
struct BoardInfo {
  std::string
      name;  ///< what open_board() takes, such as "takktile:0012"; "" where no board is known
  int bus = 0;
  int address = 0;
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::string manufacturer;  ///< as the device tells it, "" where it does not; so below
  std::string product_name;
  std::string serial;
  std::size_t elements = 0;   ///< 0 where that is not known
  double rate_hz = 0.0;       ///< frames per second, 0 where that is not known
  std::string pressure_unit;  ///< "kPa" or "raw", "" where no board is known
  bool usable = false;        ///< open_board() would succeed
  std::string reason;         ///< why not: no known board, no permission, in use
};

/// Every USB device except hubs, in the order of bus and address. Boards that are free are asked
/// for their elements; nothing is claimed, so that a stream of another program goes on.
/// @throws Error (Fault::system) where the USB itself cannot be used
std::vector<BoardInfo> list_boards();

/// The profile that open_board() reads for a board of this name, if it reads any.
/// @throws Error (Fault::input) on a name of another form
std::optional<std::filesystem::path> board_file(const std::string& name);

/// Opens a board and reads its geometry and calibration; start() of the sensor begins the stream.
///
/// `name` is "takktile", or the name of a shipped profile of a serial board ("tsf85", "wts",
/// "flexitac", "anyskin"), or the path of a profile of one's own (a name that ends in .yaml); then,
/// where several such boards are plugged in, ":" and the serial number of the one that is meant, or
/// its port such as 1-2.3.
///
/// A board that is unplugged while it streams is waited for: the sensor is gone() until a board
/// with the same serial number (or, where it has none or another board bore it too, on the same
/// port) is back; its calibration is read again and the stream goes on. start() looks for it in the
/// same way where it was unplugged while the sensor was stopped, but does not wait for it.
/// @throws Error (Fault::input) where the name is wrong or no such board is plugged in,
///         (Fault::system) where it cannot be opened: no permission, in use, or it does not answer
std::unique_ptr<Sensor> open_board(const std::string& name);

}  // namespace palpate
