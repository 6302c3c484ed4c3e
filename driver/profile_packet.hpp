#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "packet_format.hpp"
#include "yaml_entry.hpp"

namespace palpate {

/// Bytes of two hexadecimal digits each, such as "aa 55"; at least `least` of them.
/// @throws Error
std::vector<std::uint8_t> read_bytes(const YamlEntry& entry, std::size_t least = 1);

/// A whole number, decimal or hexadecimal after 0x. @throws Error
template <class Integer>
Integer read_whole(const YamlEntry& entry, Integer least,
                   Integer most = std::numeric_limits<Integer>::max()) {
  return entry.integer(least, most, YamlEntry::Digits::also_hexadecimal);
}

/// Reads the list of fields under the key `packet` of a profile.
/// @param elements values of a frame
/// @throws Error also where the fields do not make packets that can be told apart
PacketFormat read_packet_format(const YamlEntry& packet, std::size_t elements);

}  // namespace palpate
