#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "checksum.hpp"

namespace palpate {

/// A number on the wire.
struct NumberType {
  enum class Kind : std::uint8_t { unsigned_integer, signed_integer, real };
  Kind kind = Kind::unsigned_integer;
  std::uint8_t bytes = 1;  ///< 1, 2 or 4; a real has 4 (IEEE 754) or 8
  bool big_endian = false;

  /// Its value; `bytes` holds at least as many as the type.
  double read(std::span<const std::uint8_t> bytes) const;
};

/// What packets of a serial board look like: fields that follow one another without gaps.
///
/// Without a Length every packet has the same size. With one, it counts the bytes after it, up to
/// the trailing Checksum and Fixed fields; packets of another size than the values need are whole
/// packets of another kind.
struct PacketFormat {
  /// Bytes that every packet has here: the preamble at its head, the terminator at its end.
  struct Fixed {
    std::vector<std::uint8_t> bytes;
  };
  /// Bytes that packets with values have here; other packets are passed over.
  struct Only {
    std::vector<std::uint8_t> bytes;
  };
  struct Skip {
    std::size_t bytes = 0;
  };
  struct Length {
    NumberType type;
    std::size_t extra = 0;  ///< by how much the count exceeds the bytes it is to count
    std::size_t most = 0;   ///< a larger count, in bytes after it, cannot be one
  };
  struct Time {
    NumberType type;
    double tick_s = 0.001;
  };
  /// The values of all elements, in their order.
  struct Values {
    NumberType type;
    std::size_t stride_bytes = 1;  ///< from one element to the next
    std::size_t at_byte = 0;       ///< of the value in its stride
  };
  /// Some elements' values, or something else, told apart by a byte in front.
  struct Part {
    std::uint8_t tag = 0;
    std::uint8_t mask = 0xff;  ///< bits of the tag that count
    std::size_t values = 0;    ///< elements it carries, following those of the parts before it
    std::size_t skip = 0;      ///< bytes that follow without meaning here, where `values` is 0
  };
  /// Any number of parts, to the end of what the Length counts; without one, exactly one part. A
  /// frame begins with the first part that carries values, and is complete with the last.
  struct Parts {
    NumberType type;
    std::vector<Part> parts;
  };
  struct Check {
    Checksum checksum;
    bool big_endian = false;
    std::size_t from_byte = 0;  ///< where what it covers begins
    bool after = false;         ///< it covers all that follows it instead of what precedes it
  };
  using Field = std::variant<Fixed, Only, Skip, Length, Time, Values, Parts, Check>;

  std::vector<Field> fields;
  std::size_t elements = 0;  ///< values of a frame
  double gain = 1.0;         ///< pressure = gain * number + offset
  double offset = 0.0;
};

/// How the fields of a format divide: head | middle, which the Length counts | tail.
struct PacketShape {
  bool counted = false;         ///< there is a Length
  bool parts = false;           ///< there are Parts
  std::size_t head_fields = 0;  ///< up to the Length; none without one
  std::size_t tail_fields = 0;  ///< the Check and Fixed at the end
  std::size_t head_bytes = 0;
  std::size_t middle_bytes = 0;  ///< of a packet with values; counted Parts come on top
  std::size_t tail_bytes = 0;
};

PacketShape shape_of(const PacketFormat& format);

/// Bytes of a field in a packet with values; of counted Parts 0, of others those of one part.
std::size_t bytes_of(const PacketFormat::Field& field, std::size_t elements, bool counted);

/// Bytes of a part, its tag included.
std::size_t bytes_of(const PacketFormat::Parts& field, const PacketFormat::Part& part);

}  // namespace palpate
