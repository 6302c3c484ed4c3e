#include "driver/packet_format.hpp"

#include <algorithm>
#include <bit>
#include <type_traits>

namespace palpate {

namespace {

constexpr std::uint32_t mask_of(std::size_t bytes) {
  return bytes == 4 ? 0xffffffffu : (1u << (8 * bytes)) - 1;
}

constexpr std::uint32_t reflected(std::uint32_t value, std::size_t bits) {
  std::uint32_t mirror = 0;
  for (std::size_t bit = 0; bit < bits; ++bit) {
    mirror |= (value >> bit & 1u) << (bits - 1 - bit);
  }
  return mirror;
}

std::uint32_t most_significant_first(std::uint32_t byte, std::uint32_t polynomial,
                                     std::size_t bytes) {
  const std::size_t width = 8 * bytes;
  std::uint32_t crc = byte << (width - 8);
  for (int bit = 0; bit < 8; ++bit) {
    const bool carry = (crc >> (width - 1) & 1u) != 0;
    crc = (crc << 1 ^ (carry ? polynomial : 0)) & mask_of(bytes);
  }
  return crc;
}

/// The image of a register under a linear map that is given by the images of its bits.
std::uint32_t mapped(const std::array<std::uint32_t, 32>& images, std::uint32_t value) {
  std::uint32_t image = 0;
  for (; value != 0; value &= value - 1) {
    image ^= images[static_cast<std::size_t>(std::countr_zero(value))];
  }
  return image;
}

}  // namespace

Checksum::Checksum(const Parameters& parameters)
    : parameters_(parameters), mask_(mask_of(parameters.bytes)) {
  const std::size_t width = 8 * parameters_.bytes;
  const std::uint32_t polynomial =
      parameters_.kind == Kind::weiss ? 0x1021 : parameters_.polynomial;
  for (std::uint32_t byte = 0; byte < table_.size(); ++byte) {
    table_[byte] =
        parameters_.reflect
            ? reflected(most_significant_first(reflected(byte, 8), polynomial, parameters_.bytes),
                        width)
            : most_significant_first(byte, polynomial, parameters_.bytes);
  }
  // Both kinds' registers are linear over GF(2) in their last value and in the bytes.
  if (parameters_.kind == Kind::crc || parameters_.kind == Kind::weiss) {
    Map one_byte{};
    for (std::size_t bit = 0; bit < width; ++bit) {
      one_byte[bit] = run_on(std::uint32_t{1} << bit, 0);
    }
    zeros_.push_back(one_byte);
    while ((std::size_t{1} << zeros_.size()) <= longest_stretch) {
      Map twice{};
      std::ranges::transform(zeros_.back(), twice.begin(),
                             [&](std::uint32_t image) { return mapped(zeros_.back(), image); });
      zeros_.push_back(twice);
    }
  }
}

std::uint32_t Checksum::begin() const {
  if (parameters_.kind == Kind::weiss) {
    return 0xffff;
  }
  // A reflected CRC reflects its initial value, too.
  return parameters_.reflect ? reflected(parameters_.init, 8 * parameters_.bytes)
                             : parameters_.init;
}

std::uint32_t Checksum::run_on(std::uint32_t running, std::uint8_t byte) const {
  if (parameters_.kind == Kind::sum) {
    return running + byte;
  }
  if (parameters_.kind == Kind::exor) {
    return running ^ byte;
  }
  const bool least_first = parameters_.kind == Kind::weiss || parameters_.reflect;
  const std::size_t width = 8 * parameters_.bytes;
  return least_first ? running >> 8 ^ table_[(running ^ byte) & 0xff]
                     : (running << 8 & mask_) ^ table_[(running >> (width - 8) ^ byte) & 0xff];
}

std::uint32_t Checksum::operator()(std::span<const std::uint8_t> bytes) const {
  std::uint32_t running = begin();
  for (const std::uint8_t byte : bytes) {
    running = run_on(running, byte);
  }
  return (running ^ parameters_.xor_out) & mask_;
}

std::uint32_t Checksum::of_stretch(std::uint32_t before, std::uint32_t end,
                                   std::size_t bytes) const {
  // A stretch changes the difference of two running values as zero bytes would; here, the
  // difference between `before` and the initial value.
  const std::uint32_t running = parameters_.kind == Kind::sum
                                    ? end - before + begin()
                                    : end ^ over_zeros(before ^ begin(), bytes);
  return (running ^ parameters_.xor_out) & mask_;
}

std::uint32_t Checksum::over_zeros(std::uint32_t running, std::size_t bytes) const {
  for (std::size_t power = 0; power < zeros_.size(); ++power) {
    if ((bytes >> power & 1u) != 0) {
      running = mapped(zeros_[power], running);
    }
  }
  return running;
}

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
