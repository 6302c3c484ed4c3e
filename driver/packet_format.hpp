#pragma once

#include <algorithm>
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

/// Size of a part, in bytes, with its tag.
std::size_t bytes_of(const PacketFormat::Parts& field, const PacketFormat::Part& part);

/// Whether `bytes` begins with `pattern`, or `pattern` with `bytes`.
inline bool begins_like(std::span<const std::uint8_t> bytes,
                        std::span<const std::uint8_t> pattern) {
  const std::size_t known = std::min(bytes.size(), pattern.size());
  return std::ranges::equal(bytes.first(known), pattern.first(known));
}

/// A format's field as one of its kinds; nullptr where it is of another.
template <class Field>
const Field* as(const PacketFormat::Field& field) {
  return std::get_if<Field>(&field);
}

/// Where the fields of a format's packets lie.
///
///     head, to the Length | middle, which the Length counts | tail: trailing Check and Fixed
///     fields
///
/// Fields up to counted Parts keep their distance from the packet's first byte, those behind from
/// its last one. Without a Length, all packets have one size.
class PacketLayout {
 public:
  using Bytes = std::span<const std::uint8_t>;

  explicit PacketLayout(PacketFormat format);
  PacketLayout(const PacketLayout&) = delete;  // check() points into the format
  PacketLayout& operator=(const PacketLayout&) = delete;

  const PacketFormat& format() const { return format_; }
  const std::vector<PacketFormat::Field>& fields() const { return format_.fields; }
  bool has_length() const { return middle_ > 0; }
  bool has_parts() const { return has_parts_; }
  /// Indices of the first field of the middle, which is 0 without a Length, and of the tail.
  std::size_t middle() const { return middle_; }
  std::size_t tail() const { return tail_; }
  /// What packets begin with; empty where a terminator marks them.
  const std::vector<std::uint8_t>& preamble() const { return preamble_; }
  /// What packets end with; empty where a preamble marks them.
  const std::vector<std::uint8_t>& terminator() const { return terminator_; }
  /// The format's, if it has one.
  const PacketFormat::Check* check() const { return check_; }
  /// Where a field, or the end, lies in a packet with values, without counted Parts.
  std::size_t offset(std::size_t field) const { return offsets_[field]; }
  std::size_t middle_bytes() const { return offsets_[tail_] - offsets_[middle_]; }
  std::size_t whole_bytes() const { return offsets_.back(); }

  struct Packet {
    enum class Fit : std::uint8_t { none, incomplete, whole };
    Fit fit = Fit::none;
    std::size_t bytes = 0;  ///< its size, where it is whole
  };
  /// Whether a packet begins with the stream's first byte, by its fixed bytes and its length. Its
  /// checksum is not looked at.
  Packet packet_at_front(Bytes stream) const;

  /// A field of a packet with values.
  Bytes place_of(std::size_t field, Bytes packet) const;
  /// Where the Check of a packet of this size lies, and the bytes that it covers.
  struct CheckPlace {
    std::size_t offset = 0;
    std::size_t begin = 0;
    std::size_t end = 0;
  };
  CheckPlace check_place(std::size_t packet_bytes) const;

 private:
  /// Size of a field in a packet with values. Parts have size 0 if a Length counts them, and the
  /// size of one part otherwise.
  std::size_t bytes_of(const PacketFormat::Field& field) const;
  /// Where a field begins in a packet of this size.
  std::size_t begin_of(std::size_t field, std::size_t packet_bytes) const;

  PacketFormat format_;
  bool has_parts_ = false;
  std::size_t middle_ = 0;
  std::size_t tail_ = 0;
  std::vector<std::size_t> offsets_ = {0};  ///< [field + 1]
  std::size_t shifted_from_ = 0;  ///< the first field that keeps its distance from the packet's end
  std::vector<std::uint8_t> preamble_;
  std::vector<std::uint8_t> terminator_;
  const PacketFormat::Check* check_ = nullptr;
  std::size_t check_field_ = 0;
};

}  // namespace palpate
