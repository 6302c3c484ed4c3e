#pragma once

#include "packet_format.hpp"
#include "profile_entry.hpp"

namespace palpate {

/// Reads the list of fields under the key `packet` of a profile.
/// @param elements values of a frame
/// @throws Error also where the fields do not make packets that can be told apart
PacketFormat read_packet_format(const ProfileEntry& packet, std::size_t elements);

}  // namespace palpate
