#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "driver/device.hpp"
#include "driver/packet_format.hpp"

namespace palpate {

/// Settings of a serial port.
struct SerialLine {
  enum class Parity : std::uint8_t { none, odd, even };
  std::uint32_t baud = 115200;
  std::uint8_t data_bits = 8;  ///< 5 to 8
  Parity parity = Parity::none;
  std::uint8_t stop_bits = 1;  ///< 1 or 2
};

/// What a profile says of a board behind a serial port.
struct SerialProfile {
  std::string name;        ///< for people, such as "Robotiq TSF-85"
  std::vector<UsbId> usb;  ///< empty if unknown: the user must say which device it is
  SerialLine line;
  std::vector<std::uint8_t> start;      ///< bytes that make the board send frames; may be empty
  std::vector<std::uint8_t> stop;       ///< bytes that make the board stop; may be empty
  std::string pressure_unit = "raw";    ///< "kPa" or "raw"
  double rate_hz = 0.0;                 ///< frames per second; 0 if unknown
  std::vector<glm::dvec2> elements_mm;  ///< [e] in the sensor frame, in the order of the values
  PacketFormat packet;
};

/// The name of the board that has no profile.
inline const std::string takktile_kind = "takktile";

/// Names of the profiles that Palpate ships, in alphabetical order.
std::vector<std::string> shipped_profiles();

/// The file of the profile with this name or path; it need not exist. A path holds a '/' or ends in
/// ".yaml", unlike a shipped profile's name.
std::filesystem::path profile_path(const std::string& name_or_path);

/// Reads a profile: a shipped profile by its name ("tsf85"), any other profile by its path.
/// @throws Error (Fault::input) naming file, line, key, value and remedy
SerialProfile read_serial_profile(const std::string& name_or_path);

/// Reads a profile from its text. @param path names it in messages
SerialProfile parse_serial_profile(const std::string& yaml, const std::filesystem::path& path);

}  // namespace palpate
