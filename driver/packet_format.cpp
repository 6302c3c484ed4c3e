#include "driver/packet_format.hpp"

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

}  // namespace

std::uint32_t Checksum::of(std::span<const std::uint8_t> covered) const {
  std::uint32_t sum = kind == Kind::weiss ? 0xffff : init;
  for (const std::uint8_t byte : covered) {
    switch (kind) {
      case Kind::sum:
        sum += byte;
        break;
      case Kind::exor:
        sum ^= byte;
        break;
      case Kind::crc:
        sum = after_byte(sum, reflect ? reflected(byte, 8) : byte, polynomial, bytes);
        break;
      case Kind::weiss:
        sum = sum >> 8 ^ after_byte(0, (sum ^ byte) & 0xff, 0x1021, bytes);
    }
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

bool PacketFormat::checksum_is_right(Bytes packet) const {
  if (!check) {
    return true;
  }
  const std::size_t begin = begin_of(check->place, packet.size());
  const Bytes covered = check->after ? packet.subspan(begin + check->place.bytes)
                                     : packet.subspan(check->from_byte, begin - check->from_byte);
  const NumberType type{.bytes = static_cast<std::uint8_t>(check->checksum.bytes),
                        .big_endian = check->big_endian};
  return type.read(packet.subspan(begin)) == check->checksum.of(covered);
}

}  // namespace palpate
