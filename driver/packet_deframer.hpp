#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "driver/deframer.hpp"
#include "driver/packet_format.hpp"

namespace palpate {

/// Finds packets of a declared format in a byte stream and decodes them into frames. The stream may
/// begin anywhere, lose bytes and hold other packets.
///
/// In step, the deframer takes a packet when its last byte arrives. Out of step, it tries every
/// byte as the start of a packet, and accepts a packet with the right checksum; in a format without
/// checksum, a packet that another preamble follows or a terminator precedes. Such a format has two
/// limits: a payload that holds the preamble's bytes at one place in every frame may be taken for
/// the preamble until it changes, and a lost byte spoils its frame.
///
/// The work per byte is bounded for any input: checksums are computed from running values, and at
/// most 4096 bytes of parts are read in vain, in formats without checksum only. Memory: two packets
/// of the largest size and the bytes of two pushes. A non-finite reading becomes NaN.
class PacketDeframer final : public Deframer {
 public:
  /// @param format a format that read_serial_profile() has checked
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
    std::size_t bytes = 0;  // size of the packet
  };
  enum class Meaning { values, other, malformed };
  /// The part that begins with a given tag byte.
  struct KnownPart {
    std::size_t bytes = 0;  // its size with the tag; 0: no part has this tag
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
  std::vector<std::uint8_t> preamble_;    // empty: a terminator marks the packets
  std::vector<std::uint8_t> terminator_;  // empty if there is a preamble
  const Checksum* checksum_ = nullptr;    // the format's checksum, if it has one
  std::vector<KnownPart> parts_;          // [tag byte], in formats with Parts

  std::vector<std::uint8_t> buffer_;    // recent bytes of the stream
  std::vector<std::uint32_t> running_;  // running checksum before each of them and after the last
  std::size_t at_ = 0;                  // index of the first byte not yet consumed
  bool in_step_ = true;

  std::vector<double> values_;  // of the frame in progress
  std::optional<double> time_s_;
  DeframerCounters counters_;
};

}  // namespace palpate
