#pragma once

#include <memory>
#include <string>

#include "driver/serial_profile.hpp"
#include "palpate/sensor.hpp"

namespace palpate {

/// Opens a TakkTile. @param which its serial number or port; "" if only one is plugged in
/// @throws Error
std::unique_ptr<Sensor> open_takktile(const std::string& which);

/// Opens the serial port of a board that a profile describes.
/// @param kind the profile's name or path, for messages
/// @param which the board's serial number, port or device file; "" if the profile lists USB ids and
/// only one such board is plugged in
/// @throws Error
std::unique_ptr<Sensor> open_serial_board(SerialProfile profile, const std::string& kind,
                                          const std::string& which);

}  // namespace palpate
