#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "driver/packet_format.hpp"

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

/// The checksum of bytes that come behind others, by the driver.
std::uint32_t checksum_of(const Checksum& checksum, const Bytes& bytes);

/// Weiss Robotics' checksum; 0 over a packet with its own checksum behind it.
constexpr Checksum weiss{.kind = Checksum::Kind::weiss, .bytes = 2};

/// A WTS packet, whose checksum is computed so.
Bytes wts_packet(std::uint8_t id, const Bytes& payload);

Bytes random_bytes(std::size_t count, std::mt19937& random);

enum class Damage { bits_flip, some_lost, others_between, some_twice };
constexpr int kinds_of_damage = 4;

/// Damages bytes as a line or a board may damage them.
void damage(Bytes& bytes, Damage kind, std::mt19937& random);

/// The bytes of all frames, in order.
Bytes stream_of(const std::vector<SentFrame>& frames);

}  // namespace palpate
