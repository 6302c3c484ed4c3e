#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>
#include <vector>

#include "driver/packet_format.hpp"
#include "yaml/yaml_entry.hpp"

namespace palpate {

/// The number that the hexadecimal digits make; none where the text holds anything else.
std::optional<std::uint16_t> hexadecimal(std::string_view digits);

/// Bytes of two hexadecimal digits each, such as "aa 55"; at least `least` of them.
/// @throws Error
std::vector<std::uint8_t> read_bytes(const YamlEntry& entry, std::size_t least = 1);

/// Reads a whole number, decimal or hexadecimal after 0x, into `value`.
template <class Number>
auto whole_number(Number& value, std::uint32_t least,
                  std::uint32_t upper_bound = std::numeric_limits<std::uint32_t>::max()) {
  return [&value, least, upper_bound](const YamlEntry& entry) {
    value =
        static_cast<Number>(entry.integer(least, upper_bound, YamlEntry::Digits::also_hexadecimal));
  };
}

/// Reads the list of fields under the key `packet` of a profile.
/// @param elements values of a frame
/// @throws Error also where the fields do not make packets that can be told apart
PacketFormat read_packet_format(const YamlEntry& packet, std::size_t elements);

}  // namespace palpate
