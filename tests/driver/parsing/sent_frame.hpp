#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "driver/deframer.hpp"

namespace palpate {

using Bytes = std::vector<std::uint8_t>;

/// The bytes that a board sends for one frame, and the frame's values.
struct SentFrame {
  Bytes bytes;
  std::vector<double> values;
};

/// A frame with random readings of "wts", "tsf85", "flexitac", "flexitac12" or "anyskin", written
/// byte by byte after the board's protocol, without the profile.
SentFrame random_frame(const std::string& board, std::mt19937& random);
std::vector<SentFrame> random_frames(const std::string& board, std::size_t count,
                                     std::mt19937& random);

/// A WTS packet, whose checksum is computed bit by bit.
Bytes wts_packet(std::uint8_t id, const Bytes& payload);

Bytes random_bytes(std::size_t count, std::mt19937& random);

/// The bytes of all frames, in order.
Bytes stream_of(const std::vector<SentFrame>& frames);

}  // namespace palpate
