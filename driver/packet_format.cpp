#include "driver/packet_format.hpp"

#include <bit>
#include <type_traits>

namespace palpate {

double NumberType::read(std::span<const std::uint8_t> wire) const {
  // Sign extension: a negative integer fills the bytes above its own with ones.
  const bool negative = kind == Kind::signed_integer && wire[big_endian ? 0 : bytes - 1] >= 0x80;
  std::uint64_t pattern = negative ? ~std::uint64_t{0} : 0;
  for (std::size_t i = 0; i < bytes; ++i) {
    pattern = pattern << 8 | wire[big_endian ? i : bytes - 1 - i];
  }
  if (kind == Kind::real) {
    return bytes == 8 ? std::bit_cast<double>(pattern)
                      : double{std::bit_cast<float>(static_cast<std::uint32_t>(pattern))};
  }
  return negative ? static_cast<double>(static_cast<std::int64_t>(pattern))
                  : static_cast<double>(pattern);
}

std::size_t bytes_of(const PacketFormat::Field& field, std::size_t elements, bool counted) {
  return std::visit(
      [&](const auto& content) -> std::size_t {
        using Content = std::decay_t<decltype(content)>;
        if constexpr (std::is_same_v<Content, PacketFormat::Fixed> ||
                      std::is_same_v<Content, PacketFormat::Only>) {
          return content.bytes.size();
        } else if constexpr (std::is_same_v<Content, PacketFormat::Skip>) {
          return content.bytes;
        } else if constexpr (std::is_same_v<Content, PacketFormat::Length> ||
                             std::is_same_v<Content, PacketFormat::Time>) {
          return content.type.bytes;
        } else if constexpr (std::is_same_v<Content, PacketFormat::Values>) {
          return elements * content.stride_bytes;
        } else if constexpr (std::is_same_v<Content, PacketFormat::Parts>) {
          return counted ? 0 : bytes_of(content, content.parts.front());
        } else {
          return content.checksum.bytes();
        }
      },
      field);
}

std::size_t bytes_of(const PacketFormat::Parts& field, const PacketFormat::Part& part) {
  return 1 + part.skip + part.values * field.type.bytes;
}

PacketShape shape_of(const PacketFormat& format) {
  PacketShape shape;
  const std::vector<PacketFormat::Field>& fields = format.fields;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (std::holds_alternative<PacketFormat::Length>(fields[i])) {
      shape.counted = true;
      shape.head_fields = i + 1;
    }
    shape.parts = shape.parts || std::holds_alternative<PacketFormat::Parts>(fields[i]);
  }
  while (shape.tail_fields < fields.size() - shape.head_fields) {
    const PacketFormat::Field& last = fields[fields.size() - 1 - shape.tail_fields];
    if (!std::holds_alternative<PacketFormat::Check>(last) &&
        !std::holds_alternative<PacketFormat::Fixed>(last)) {
      break;
    }
    ++shape.tail_fields;
  }
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const std::size_t bytes = bytes_of(fields[i], format.elements, shape.counted);
    if (i < shape.head_fields) {
      shape.head_bytes += bytes;
    } else if (i < fields.size() - shape.tail_fields) {
      shape.middle_bytes += bytes;
    } else {
      shape.tail_bytes += bytes;
    }
  }
  return shape;
}

}  // namespace palpate
