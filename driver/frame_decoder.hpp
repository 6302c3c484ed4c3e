#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "driver/deframer.hpp"
#include "driver/packet_layout.hpp"

namespace palpate {

/// Decodes packets, one after the other, into frames. A frame may come in several packets: each
/// with one Part of it, or its clock before its values.
class FrameDecoder {
 public:
  using Bytes = PacketLayout::Bytes;

  /// @param layout outlives this object
  explicit FrameDecoder(const PacketLayout& layout);

  enum class Meaning : std::uint8_t { values, other, malformed };
  /// Decodes a whole packet, and appends the frames that it completes. A non-finite reading becomes
  /// NaN. A packet that an Only field passes over, or that carries no values, is another one.
  Meaning take(Bytes packet, std::vector<ParsedFrame>& frames);

  /// Forgets the values of the frame in progress.
  void forget_values() { values_.clear(); }
  /// Forgets the frame in progress, with its time.
  void forget_frame();
  /// Forgets the clock's last reading, too; its unit stays known.
  void reset();

 private:
  /// The part that begins with a given tag byte.
  struct KnownPart {
    std::size_t bytes = 0;  ///< its size with the tag; 0: no part has this tag
    std::size_t values = 0;
    std::size_t first_element = 0;
    std::optional<PacketFormat::Time> time = {};
  };

  void know_parts(const PacketFormat::Parts& parts);
  void read_values(const PacketFormat::Values& field, Bytes bytes,
                   std::vector<ParsedFrame>& frames);
  Bytes known_parts(Bytes bytes) const;
  void read_time(Bytes bytes);
  double tick_of(double ticks);
  void read_parts(const PacketFormat::Parts& field, Bytes bytes, std::vector<ParsedFrame>& frames);
  void append_value(double number);
  void complete_frame(std::vector<ParsedFrame>& frames);

  const PacketLayout& layout_;
  std::vector<KnownPart> parts_;  ///< [tag byte], in formats with Parts
  std::vector<double> values_;    ///< of the frame in progress
  std::optional<double> time_s_;
  std::optional<double> last_ticks_;  ///< of a clock whose unit is not stated
  double tick_s_ = 0.0;               ///< its unit; 0: not known yet
};

}  // namespace palpate
