#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <variant>
#include <vector>

namespace palpate {

/// A checksum of 1, 2 or 4 bytes over part of a packet.
class Checksum {
 public:
  enum class Kind : std::uint8_t {
    sum,    ///< sum of the bytes
    exor,   ///< exclusive or of the bytes
    crc,    ///< CRC by Rocksoft's parameters below; `reflect` covers its input and its output
    weiss,  ///< Weiss Robotics' 16 bits: CRC-16 0x1021's table, indexed as in a reflected CRC
  };
  struct Parameters {
    Kind kind = Kind::crc;
    std::size_t bytes = 1;  ///< 1, 2 or 4
    std::uint32_t polynomial = 0;
    std::uint32_t init = 0;
    std::uint32_t xor_out = 0;
    bool reflect = false;
  };

  explicit Checksum(const Parameters& parameters);

  std::uint32_t operator()(std::span<const std::uint8_t> bytes) const;
  std::size_t bytes() const { return parameters_.bytes; }

  /// Computes the checksum of a stretch of a stream in at most 18 short steps from the stream's
  /// run_on() values in front of the stretch (`before`) and behind it (`end`).
  /// @param bytes length of the stretch, at most longest_stretch
  std::uint32_t of_stretch(std::uint32_t before, std::uint32_t end, std::size_t bytes) const;
  static constexpr std::size_t longest_stretch = (std::size_t{1} << 18) - 1;

  /// The running value of a stream after one more byte. The stream may begin with any value.
  std::uint32_t run_on(std::uint32_t running, std::uint8_t byte) const;

 private:
  using Map = std::array<std::uint32_t, 32>;  // linear map of a register: the image of each bit

  std::uint32_t begin() const;
  std::uint32_t over_zeros(std::uint32_t running, std::size_t bytes) const;

  Parameters parameters_;
  std::uint32_t mask_ = 0;
  std::vector<Map> zeros_;                     // [k]: what 2^k zero bytes do to the register
  std::array<std::uint32_t, 256> table_ = {};  // [byte], for crc and weiss
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

/// The layout of a serial board's packets: a list of fields without gaps.
///
/// Without a Length field, all packets have one size. With a Length field, packets differ in size,
/// and packets of another size than the values need carry no values.
struct PacketFormat {
  /// Bytes that every packet has at this place: a preamble at its head, a terminator at its end.
  struct Fixed {
    std::vector<std::uint8_t> bytes;
  };
  /// Bytes that packets with values have at this place; packets with other bytes are passed over.
  struct Only {
    std::vector<std::uint8_t> bytes;
  };
  struct Skip {
    std::size_t bytes = 0;
  };
  /// The number of bytes from here up to the trailing Check and Fixed fields, plus `extra`.
  struct Length {
    NumberType type;
    std::size_t extra = 0;
    std::size_t most = 0;  ///< no packet has a larger count, `extra` left out
  };
  struct Time {
    NumberType type;
    double tick_s = 0.001;
  };
  /// The values of all elements, in the elements' order.
  struct Values {
    NumberType type;
    std::size_t stride_bytes = 1;  ///< from one element to the next
    std::size_t at_byte = 0;       ///< offset of the value within its stride
  };
  /// A tag byte, then the values of some elements or other data.
  struct Part {
    std::uint8_t tag = 0;
    std::uint8_t mask = 0xff;  ///< bits of the tag byte that are compared with `tag`
    std::size_t values = 0;    ///< number of values, for the elements after the previous Part's
    std::size_t skip = 0;      ///< bytes of other data, if `values` is 0
    /// The board's clock in those bytes. A tick of 0 s: its unit is a millisecond, microsecond or
    /// nanosecond, whichever fits `period_s`.
    std::optional<Time> time = {};
  };
  /// Parts up to the end of the bytes that the Length counts; exactly one part without a Length. A
  /// frame begins with the first Part of the list that has values, and ends with the last one.
  struct Parts {
    NumberType type;
    std::vector<Part> parts;
  };
  struct Check {
    Checksum checksum;
    bool big_endian = false;
    std::size_t from_byte = 0;  ///< first byte of the packet that it covers
    bool after = false;         ///< it covers the bytes behind it instead of those in front
  };
  using Field = std::variant<Fixed, Only, Skip, Length, Time, Values, Parts, Check>;

  std::vector<Field> fields;
  std::size_t elements = 0;  ///< values per frame
  double gain = 1.0;         ///< pressure = gain * number + offset
  double offset = 0.0;
  double period_s = 0.0;  ///< from frame to frame; 0: unknown
};

/// The sections of a format: head | middle, whose bytes the Length counts | tail.
struct PacketShape {
  bool counted = false;         ///< the format has a Length
  bool parts = false;           ///< the format has Parts
  std::size_t head_fields = 0;  ///< fields up to the Length; 0 without a Length
  std::size_t tail_fields = 0;  ///< the trailing Check and Fixed fields
  std::size_t head_bytes = 0;
  std::size_t middle_bytes = 0;  ///< in a packet with values, without counted Parts
  std::size_t tail_bytes = 0;
};

PacketShape shape_of(const PacketFormat& format);

/// Size of a field, in bytes, in a packet with values. Parts have size 0 if a Length counts them,
/// and the size of one part otherwise.
std::size_t bytes_of(const PacketFormat::Field& field, std::size_t elements, bool counted);

/// Size of a part, in bytes, with its tag.
std::size_t bytes_of(const PacketFormat::Parts& field, const PacketFormat::Part& part);

}  // namespace palpate
