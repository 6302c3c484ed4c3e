#include "driver/packet_format.hpp"

#include <algorithm>
#include <bit>

namespace palpate {

namespace {

std::uint32_t mask_of(std::size_t bytes) {
  return bytes == 4 ? 0xffffffffu : (1u << (8 * bytes)) - 1;
}

std::uint32_t reflected(std::uint32_t value, std::size_t bits) {
  std::uint32_t mirror = 0;
  for (std::size_t bit = 0; bit < bits; ++bit) {
    mirror |= (value >> bit & 1u) << (bits - 1 - bit);
  }
  return mirror;
}

/// A CRC's register after one more byte, whose most significant bit comes first.
std::uint32_t after_byte(std::uint32_t crc, std::uint32_t byte, std::uint32_t polynomial,
                         std::size_t bytes) {
  const std::uint32_t mask = mask_of(bytes);
  const std::uint32_t top_bit = mask ^ mask >> 1;
  for (int bit = 7; bit >= 0; --bit) {
    const bool carry = ((crc & top_bit) != 0) != ((byte >> bit & 1u) != 0);
    crc = (crc << 1 ^ (carry ? polynomial : 0)) & mask;
  }
  return crc;
}

/// The image of a register under a linear map that is given by the images of its bits.
std::uint32_t image_of(std::uint32_t sum, std::span<const std::uint32_t> images) {
  std::uint32_t image = 0;
  for (; sum != 0; sum &= sum - 1) {
    image ^= images[static_cast<std::size_t>(std::countr_zero(sum))];
  }
  return image;
}

}  // namespace

RunningChecksum::RunningChecksum(const Checksum& checksum) : checksum_(checksum) {
  Map& one = zeros_.emplace_back();
  for (std::size_t bit = 0; bit < 8 * checksum_.bytes; ++bit) {
    one[bit] = after(1u << bit, 0);
  }
  while (zeros_.size() < 18) {
    const Map half = zeros_.back();
    std::ranges::transform(half, zeros_.emplace_back().begin(),
                           [&](std::uint32_t sum) { return image_of(sum, half); });
  }
}

void RunningChecksum::push(std::span<const std::uint8_t> bytes) {
  for (const std::uint8_t byte : bytes) {
    sums_.push_back(after(sums_.back(), byte));
  }
}

void RunningChecksum::erase(std::size_t bytes) {
  sums_.erase(sums_.begin(), sums_.begin() + static_cast<std::ptrdiff_t>(bytes));
}

std::uint32_t RunningChecksum::after(std::uint32_t sum, std::uint8_t byte) const {
  switch (checksum_.kind) {
    case Checksum::Kind::sum:
      return sum + byte;
    case Checksum::Kind::exor:
      return sum ^ byte;
    case Checksum::Kind::crc:
      return after_byte(sum, checksum_.reflect ? reflected(byte, 8) : byte, checksum_.polynomial,
                        checksum_.bytes);
    case Checksum::Kind::weiss:
      break;
  }
  return sum >> 8 ^ after_byte(0, (sum ^ byte) & 0xff, 0x1021, checksum_.bytes);
}

std::uint32_t RunningChecksum::of(std::size_t begin, std::size_t end) const {
  const auto& [kind, bytes, polynomial, init, xor_out, reflect] = checksum_;
  std::uint32_t sum = kind == Checksum::Kind::weiss ? 0xffff : init;
  if (kind == Checksum::Kind::sum) {
    sum += sums_[end] - sums_[begin];
  } else {
    // Registers are linear in their first value and the bytes: where only the first values differ,
    // the last ones differ as if all bytes were zero.
    sum ^= sums_[begin];
    for (std::size_t i = 0; i < zeros_.size(); ++i) {
      sum = (end - begin) >> i & 1u ? image_of(sum, zeros_[i]) : sum;
    }
    sum ^= sums_[end];
  }
  return ((reflect ? reflected(sum, 8 * bytes) : sum) ^ xor_out) & mask_of(bytes);
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

std::size_t PacketFormat::begin_of(const Place& place, std::size_t packet_bytes) const {
  const std::size_t moved_from = parts ? parts->place.offset : tail;
  return place.offset < moved_from ? place.offset : place.offset + packet_bytes - bytes;
}

std::optional<std::size_t> PacketFormat::packet_bytes(Bytes stream) const {
  std::size_t total = bytes;
  if (length && stream.size() >= length->place.end()) {
    const double count = length->type.read(stream.subspan(length->place.offset)) -
                         static_cast<double>(length->extra);
    if (count < 0 || count > static_cast<double>(length->most)) {
      return std::nullopt;
    }
    total += static_cast<std::size_t>(count) - (tail - head_bytes());
  }
  for (const Pattern& pattern : fixed) {
    const std::size_t begin = begin_of(pattern.place, total);
    if (begin <= stream.size() && !begins_like(stream.subspan(begin), pattern.bytes)) {
      return std::nullopt;
    }
  }
  return total;
}

}  // namespace palpate
