#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace palpate {

/// A checksum of 1, 2 or 4 bytes over part of a packet.
struct Checksum {
  enum class Kind : std::uint8_t {
    sum,    ///< sum of the bytes
    exor,   ///< exclusive or of the bytes
    crc,    ///< CRC by Rocksoft's parameters below; `reflect` covers its input and its output
    weiss,  ///< Weiss Robotics' 16 bits: CRC-16 0x1021's table, indexed as in a reflected CRC
  };
  Kind kind = Kind::crc;
  std::size_t bytes = 1;  ///< 1, 2 or 4
  std::uint32_t polynomial = 0;
  std::uint32_t init = 0;
  std::uint32_t xor_out = 0;
  bool reflect = false;
};

/// Checksums of stretches of a stream. The work for one is bounded whatever its length: where every
/// byte begins like a packet, a sum over each of these packets would not keep up with the line.
class RunningChecksum {
 public:
  explicit RunningChecksum(const Checksum& checksum);

  void push(std::span<const std::uint8_t> bytes);
  /// Forgets the first bytes; the others' indices fall by their number.
  void erase(std::size_t bytes);
  /// The checksum of the bytes [begin, end), at most 2^18 - 1.
  std::uint32_t of(std::size_t begin, std::size_t end) const;

 private:
  using Map = std::array<std::uint32_t, 32>;  // a linear map, by the images of the register's bits

  std::uint32_t after(std::uint32_t sum, std::uint8_t byte) const;

  Checksum checksum_;
  std::vector<std::uint32_t> sums_{0};  // the register before each byte and after the last
  std::vector<Map> zeros_;              // of 2^i zero bytes
};

/// The type of a number in a packet.
struct NumberType {
  enum class Kind : std::uint8_t { unsigned_integer, signed_integer, real };
  Kind kind = Kind::unsigned_integer;
  std::uint8_t bytes = 1;  ///< 1, 2, 4 or 8; a real (IEEE 754) has 4 or 8
  bool big_endian = false;

  /// Decodes the number at the start of `bytes`, which must hold all of it.
  double read(std::span<const std::uint8_t> bytes) const;
};

/// Whether `bytes` begins with `pattern`, or `pattern` with `bytes`.
inline bool begins_like(std::span<const std::uint8_t> bytes,
                        std::span<const std::uint8_t> pattern) {
  const std::size_t known = std::min(bytes.size(), pattern.size());
  return std::ranges::equal(bytes.first(known), pattern.first(known));
}

/// The layout of a serial board's packets: fields without gaps.
///
///     head, to the Length | middle, which the Length counts | tail: trailing checksum and bytes
///
/// Without a Length, all packets have one size. With a Length, packets differ in size, and packets
/// of another size than the values need carry no values.
struct PacketFormat {
  using Bytes = std::span<const std::uint8_t>;

  /// Where a field lies in a packet with values whose counted Parts are empty.
  struct Place {
    std::size_t offset = 0;
    std::size_t bytes = 0;
    std::size_t end() const { return offset + bytes; }
  };
  struct Pattern {
    Place place;
    std::vector<std::uint8_t> bytes;
  };
  /// The number of bytes of the middle, plus `extra`.
  struct Length {
    Place place;
    NumberType type;
    std::size_t extra = 0;
    std::size_t most = 0;  ///< no packet has a larger count, `extra` left out
  };
  struct Clock {
    NumberType type;
    double tick_s = 0.001;
  };
  struct Time {
    Place place;
    Clock clock;
  };
  /// The values of all elements, in the elements' order.
  struct Values {
    Place place;
    NumberType type;
    std::size_t stride_bytes = 0;  ///< from one element to the next
    std::size_t at_byte = 0;       ///< offset of the value within its stride
  };
  /// A tag byte, then the values of some elements or other data.
  struct Part {
    std::uint8_t tag = 0;
    std::uint8_t mask = 0xff;  ///< bits of the tag byte that are compared with `tag`
    std::size_t bytes = 1;     ///< with the tag
    std::size_t values = 0;    ///< number of values
    std::size_t first_element = 0;
    /// The board's clock, in a part without values. A tick of 0 s: its unit is a millisecond,
    /// microsecond or nanosecond, whichever fits `period_s`.
    std::optional<Clock> clock = {};
  };
  /// Parts up to the end of the bytes that the Length counts; exactly one part without a Length. A
  /// frame begins with the first Part of the list that has values, and ends with the last one. A
  /// tag that fits several parts means the first of them.
  struct Parts {
    Place place;  ///< of 0 bytes where a Length counts them
    NumberType type;
    std::vector<Part> list;
  };
  struct Check {
    Place place;
    Checksum checksum;
    bool big_endian = false;
    std::size_t from_byte = 0;  ///< first byte of the packet that it covers
    bool after = false;         ///< it covers the bytes behind it instead of those in front
  };

  std::vector<Pattern> fixed;  ///< bytes that every packet has there
  std::vector<Pattern> only;   ///< packets with other bytes there carry no values
  std::optional<Length> length;
  std::optional<Time> time;
  std::optional<Values> values;  ///< a format has either these or parts
  std::optional<Parts> parts;
  std::optional<Check> check;
  std::vector<std::uint8_t> preamble;    ///< of every packet; empty where a terminator marks them
  std::vector<std::uint8_t> terminator;  ///< of every packet; empty where a preamble marks them
  std::size_t tail = 0;                  ///< where the tail begins
  std::size_t bytes = 0;                 ///< of a packet with values whose counted Parts are empty

  std::size_t elements = 0;  ///< values per frame
  double gain = 1.0;         ///< pressure = gain * number + offset
  double offset = 0.0;
  double period_s = 0.0;  ///< from frame to frame; 0: unknown

  std::size_t head_bytes() const { return length ? length->place.end() : 0; }

  /// Where a field begins in a packet of this size: fields behind counted Parts, and those of the
  /// tail, keep their distance from the packet's last byte.
  std::size_t begin_of(const Place& place, std::size_t packet_bytes) const;

  /// The size of the packet that the stream begins with, by its fixed bytes and its length: none
  /// where it begins with no packet, more than the stream has where more bytes have to come first.
  /// The checksum is not looked at.
  std::optional<std::size_t> packet_bytes(Bytes stream) const;
};

}  // namespace palpate
