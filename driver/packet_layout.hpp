#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "driver/packet_format.hpp"

namespace palpate {

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
  const PacketShape& shape() const { return shape_; }
  const std::vector<PacketFormat::Field>& fields() const { return format_.fields; }
  /// What packets begin with; empty where a terminator marks them.
  const std::vector<std::uint8_t>& preamble() const { return preamble_; }
  /// What packets end with; empty where a preamble marks them.
  const std::vector<std::uint8_t>& terminator() const { return terminator_; }
  /// The format's, if it has one.
  const PacketFormat::Check* check() const { return check_; }
  /// Size of a packet with values, without counted Parts.
  std::size_t whole_bytes() const { return whole_bytes_; }

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
  /// Where a field begins in a packet of this size.
  std::size_t begin_of(std::size_t field, std::size_t packet_bytes) const;

  PacketFormat format_;
  PacketShape shape_;
  std::vector<std::size_t> offsets_;  ///< [field] in a packet with values, without counted Parts
  std::size_t whole_bytes_ = 0;
  std::size_t shifted_from_;  ///< the first field that keeps its distance from the packet's end
  std::vector<std::uint8_t> preamble_;
  std::vector<std::uint8_t> terminator_;
  const PacketFormat::Check* check_ = nullptr;
  std::size_t check_field_ = 0;
};

}  // namespace palpate
