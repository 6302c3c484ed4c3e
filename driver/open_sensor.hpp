#pragma once

#include <memory>
#include <string>

#include "driver/serial_profile.hpp"
#include "palpate/sensor.hpp"

namespace palpate {

/// Opens a TakkTile, without claiming its interface, and reads what it tells of itself.
/// @throws Error
SensorDescription describe_takktile(const ListedDevice& device);

/// Opens a TakkTile. @param which its serial number or port; "" if only one is plugged in
/// @throws Error
std::unique_ptr<Sensor> open_takktile(const std::string& which);

/// Why the device file of a port could not be opened with this errno, and the remedy.
std::string why_not_opened(const std::string& node, int code);

/// Opens the serial port of a board that a profile describes.
/// @param kind the profile's name or path, for messages
/// @param which the board's serial number, port or device file; "" if the profile lists USB ids and
/// only one such board is plugged in
/// @throws Error
std::unique_ptr<Sensor> open_serial_board(SerialProfile profile, const std::string& kind,
                                          const std::string& which);

}  // namespace palpate
