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
/// The work per byte is bounded whatever the bytes are: a candidate's checksum comes from running
/// values, and only in formats without checksum the parts of a candidate, at most 4096 bytes, may
/// be gone through in vain. Holds at most two packets of the largest size and what two pushes
/// bring.
///
/// A reading that is no number, as a float may be, is a NaN in its frame.
class PacketDeframer final : public Deframer {
 public:
  /// @param format as read_serial_profile() checks it
  explicit PacketDeframer(PacketFormat format);
  PacketDeframer(const PacketDeframer&) = delete;
  PacketDeframer& operator=(const PacketDeframer&) = delete;

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
  /// What a tag byte begins.
  struct KnownPart {
    std::size_t bytes = 0;  // its tag included; 0: no part has that tag
    std::size_t values = 0;
    std::size_t first_element = 0;
  };

  bool take_step(std::vector<ParsedFrame>& frames);
  void drop_byte();
  bool follows_terminator() const;
  Candidate inspect(Bytes stream) const;
  bool checksum_is_right(Bytes packet) const;
  void forget_consumed();

  Meaning interpret(Bytes packet, std::vector<ParsedFrame>& frames);
  std::vector<Bytes> locate_fields(Bytes packet) const;
  void read_values(const PacketFormat::Values& field, Bytes bytes,
                   std::vector<ParsedFrame>& frames);
  bool are_parts(Bytes bytes) const;
  void read_parts(const PacketFormat::Parts& field, Bytes bytes, std::vector<ParsedFrame>& frames);
  void append_value(double number);
  void complete_frame(std::vector<ParsedFrame>& frames);

  PacketFormat format_;
  PacketShape shape_;
  std::vector<std::uint8_t> preamble_;    // empty: packets are told by their terminator
  std::vector<std::uint8_t> terminator_;  // empty where there is a preamble
  const Checksum* checksum_ = nullptr;    // of the format; none where it has none
  std::vector<KnownPart> parts_;          // by tag byte, in formats with Parts

  std::vector<std::uint8_t> buffer_;    // of the stream; before at_, what may hold a terminator
  std::vector<std::uint32_t> running_;  // the checksum's, before each byte and after the last
  std::size_t at_ = 0;
  bool in_step_ = true;

  std::vector<double> values_;  // of the frame that is not complete, so far
  std::optional<double> time_s_;
  DeframerCounters counters_;
};

}  // namespace palpate
