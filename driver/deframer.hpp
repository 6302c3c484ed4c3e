#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "driver/packet_format.hpp"
#include "palpate/sensor.hpp"

namespace palpate {

/// Finds packets of a declared format in a byte stream, which may begin anywhere, lose bytes and
/// hold other packets, and decodes them into frames. Accepts any bytes and does no I/O.
///
/// For example, two elements and their sum behind a preamble:
///
///     packet: [{bytes: aa 55}, {values: u8}, {checksum: sum8, from: 2}]
///
///     31              garbage: no packet begins so, and the next byte is tried
///     aa 55 07 09 10  a packet, as 07 + 09 = 10: the frame 7, 9
///     aa 55           its rest was lost: aa 55 aa 55 03 has a wrong sum, and aa and 55 are garbage
///     aa 55 03 04 07  a packet: the frame 3, 4
///     aa 55 05 06 ff  a wrong sum, and five bytes of garbage
///
/// - In step, a packet is taken when its last byte arrives.
/// - Out of step, every byte is tried as the start of a packet. A packet counts if its checksum is
///   right; in a format without checksum, if another preamble follows or a terminator precedes it.
///   Such a format has two limits: a payload that holds the preamble's bytes at one place in every
///   frame may be taken for the preamble until it changes, and a lost byte spoils its frame.
///
/// A frame may come in several packets: each with one Part of it, or its clock before its values.
/// The work per byte is bounded for any input: a checksum costs the same for all packets, and at
/// most 4096 bytes of parts are read in vain, in formats without checksum only. Memory: two packets
/// of the largest size and the bytes of two pushes, five times as much in formats with a checksum.
class PacketDeframer {
 public:
  using Bytes = PacketFormat::Bytes;

  explicit PacketDeframer(PacketFormat format);

  /// Takes the next bytes of the stream, in pieces of any size, and appends the frames that they
  /// complete: their values, NaN for a non-finite reading, and their time by the board's clock.
  void push(Bytes bytes, std::vector<Frame>& frames);
  /// Counts packets with a wrong checksum, and bytes that belong to no packet.
  const SensorCounters& counters() const { return counters_; }

 private:
  struct FoundPart {
    const PacketFormat::Part* part;
    Bytes content;
  };

  /// Takes a packet or drops a byte; false where more bytes have to come first.
  bool take_step(std::vector<Frame>& frames);
  /// Returns true: a step is taken.
  bool drop_byte();
  bool follows_terminator() const;
  /// Whether the packet at at_ has the right checksum, or the format has none.
  bool checksum_is_right(Bytes packet) const;
  /// Decodes a packet, and appends the frames that it completes; false where it is malformed.
  bool decode(Bytes packet, std::vector<Frame>& frames);
  /// Finds the parts in front of the first whose tag is not known; false where one is cut short.
  bool find_parts(Bytes bytes);
  void read_clock(const PacketFormat::Clock& clock, Bytes bytes);
  /// The unit of a clock that does not state it, from its first step; 0 where it is not known yet.
  double tick_of(double ticks);
  void read_part(const FoundPart& found, std::vector<Frame>& frames);
  void append_value(double number);
  void complete_frame(std::vector<Frame>& frames);

  PacketFormat format_;
  std::vector<std::uint8_t> buffer_;     // recent bytes of the stream
  std::optional<RunningChecksum> sums_;  // of buffer_, in formats with a checksum
  std::size_t at_ = 0;                   // index of the first byte not yet consumed
  bool in_step_ = true;
  SensorCounters counters_;
  std::vector<double> values_;        // of the frame in progress
  std::optional<double> time_s_;      // of the frame in progress
  std::optional<double> last_ticks_;  // of a clock whose unit is not stated
  double tick_s_ = 0.0;               // its unit; 0: not known yet
  std::vector<FoundPart> found_;      // of the packet that is decoded
};

}  // namespace palpate
