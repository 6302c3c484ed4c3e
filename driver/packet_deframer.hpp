#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "deframer.hpp"
#include "packet_format.hpp"

namespace palpate {

/// Finds packets of a declared format in a stream that may begin anywhere, lose bytes and hold
/// others, and makes frames of them.
///
/// In step, a packet is taken as soon as its last byte is there. Out of step, a candidate is tried
/// at every byte; it is believed where its checksum is right or, in a format without one, where
/// another preamble follows it, or a terminator precedes it. So, where the payload holds the
/// marker at the same place frame after frame, a format without checksum may start on it; it gets
/// into step when that byte changes. In the same format a lost byte spoils the frame that lost it.
///
/// Holds at most one packet of the largest size and what one push brings.
class PacketDeframer final : public Deframer {
 public:
  /// @param format as read_serial_profile() checks it
  explicit PacketDeframer(PacketFormat format);

  void push(std::span<const std::uint8_t> bytes, std::vector<ParsedFrame>& frames) override;
  void reset() override;
  const DeframerCounters& counters() const override { return counters_; }

 private:
  using Bytes = std::span<const std::uint8_t>;

  enum class Verdict { none, incomplete, wrong_checksum, whole };
  struct Candidate {
    Verdict verdict = Verdict::none;
    std::size_t bytes = 0;  // of the whole packet
  };
  enum class Meaning { values, other, malformed };

  bool take_step(std::vector<ParsedFrame>& frames);
  void drop_byte();
  bool follows_terminator() const;
  Candidate inspect(Bytes stream) const;
  bool checksum_is_right(Bytes packet) const;

  Meaning interpret(Bytes packet, std::vector<ParsedFrame>& frames);
  std::vector<Bytes> locate_fields(Bytes packet) const;
  bool read_values(const PacketFormat::Values& field, Bytes bytes,
                   std::vector<ParsedFrame>& frames);
  bool read_parts(const PacketFormat::Parts& field, Bytes bytes, std::vector<ParsedFrame>& frames);
  bool read_part(const PacketFormat::Parts& field, const PacketFormat::Part& part, Bytes bytes);
  bool append_value(double number);
  void complete_frame(std::vector<ParsedFrame>& frames);

  PacketFormat format_;
  PacketShape shape_;
  std::vector<std::uint8_t> preamble_;    // empty: packets are told by their terminator
  std::vector<std::uint8_t> terminator_;  // empty where there is a preamble
  bool checked_ = false;                  // there is a checksum

  std::vector<std::uint8_t> buffer_;  // of the stream; before at_, what may hold a terminator
  std::size_t at_ = 0;
  bool in_step_ = true;

  std::vector<double> values_;  // of the frame that is not complete, so far
  std::optional<double> time_s_;
  DeframerCounters counters_;
};

}  // namespace palpate
