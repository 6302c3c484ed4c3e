#include "driver/packet_format.hpp"

#include <algorithm>
#include <bit>
#include <type_traits>
#include <utility>

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

std::size_t bytes_of(const PacketFormat::Parts& field, const PacketFormat::Part& part) {
  return 1 + part.skip + part.values * field.type.bytes;
}

PacketLayout::PacketLayout(PacketFormat format)
    : format_(std::move(format)), tail_(fields().size()) {
  if (const auto* first = as<PacketFormat::Fixed>(fields().front())) {
    preamble_ = first->bytes;
  } else if (const auto* last = as<PacketFormat::Fixed>(fields().back())) {
    terminator_ = last->bytes;
  }
  for (std::size_t i = 0; i < fields().size(); ++i) {
    middle_ = as<PacketFormat::Length>(fields()[i]) != nullptr ? i + 1 : middle_;
  }
  while (tail_ > middle_ && (as<PacketFormat::Check>(fields()[tail_ - 1]) != nullptr ||
                             as<PacketFormat::Fixed>(fields()[tail_ - 1]) != nullptr)) {
    --tail_;
  }
  shifted_from_ = tail_;
  for (std::size_t i = 0; i < fields().size(); ++i) {
    offsets_.push_back(offsets_.back() + bytes_of(fields()[i]));
    if (const auto* check = as<PacketFormat::Check>(fields()[i])) {
      check_ = check;
      check_field_ = i;
    } else if (as<PacketFormat::Parts>(fields()[i]) != nullptr) {
      has_parts_ = true;
      shifted_from_ = std::min(shifted_from_, i + 1);
    }
  }
}

std::size_t PacketLayout::bytes_of(const PacketFormat::Field& field) const {
  return std::visit(
      [this](const auto& content) -> std::size_t {
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
          return format_.elements * content.stride_bytes;
        } else if constexpr (std::is_same_v<Content, PacketFormat::Parts>) {
          return has_length() ? 0 : palpate::bytes_of(content, content.parts.front());
        } else {
          return content.checksum.bytes();
        }
      },
      field);
}

std::size_t PacketLayout::begin_of(std::size_t field, std::size_t packet_bytes) const {
  return offsets_[field] + (field < shifted_from_ ? 0 : packet_bytes - whole_bytes());
}

PacketLayout::Bytes PacketLayout::place_of(std::size_t field, Bytes packet) const {
  const bool is_counted = has_length() && as<PacketFormat::Parts>(fields()[field]) != nullptr;
  return packet.subspan(
      begin_of(field, packet.size()),
      is_counted ? packet.size() - whole_bytes() : offsets_[field + 1] - offsets_[field]);
}

PacketLayout::CheckPlace PacketLayout::check_place(std::size_t packet_bytes) const {
  const std::size_t offset = begin_of(check_field_, packet_bytes);
  return check_->after ? CheckPlace{offset, offset + check_->checksum.bytes(), packet_bytes}
                       : CheckPlace{offset, check_->from_byte, offset};
}

PacketLayout::Packet PacketLayout::packet_at_front(Bytes stream) const {
  std::size_t total = whole_bytes();
  // Behind a Length, only packets with values have a field at its offset. The tail follows below.
  const std::size_t known = has_length() ? middle_ : fields().size();
  for (std::size_t i = 0; i < known && offsets_[i] <= stream.size(); ++i) {
    const Bytes rest = stream.subspan(offsets_[i]);
    if (const auto* fixed = as<PacketFormat::Fixed>(fields()[i])) {
      if (!begins_like(rest, fixed->bytes)) {
        return {Packet::Fit::none};
      }
    } else if (const auto* length = as<PacketFormat::Length>(fields()[i])) {
      if (rest.size() < length->type.bytes) {
        return {Packet::Fit::incomplete};
      }
      const double count = length->type.read(rest) - static_cast<double>(length->extra);
      if (count < 0 || count > static_cast<double>(length->most)) {
        return {Packet::Fit::none};
      }
      total += static_cast<std::size_t>(count) - middle_bytes();
    }
  }
  if (stream.size() < total) {
    return {Packet::Fit::incomplete};
  }
  for (std::size_t i = tail_; i < fields().size(); ++i) {
    const auto* fixed = as<PacketFormat::Fixed>(fields()[i]);
    if (fixed != nullptr &&
        !begins_like(stream.first(total).subspan(begin_of(i, total)), fixed->bytes)) {
      return {Packet::Fit::none};
    }
  }
  return {Packet::Fit::whole, total};
}

}  // namespace palpate
