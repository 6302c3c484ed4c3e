#include "checksum.hpp"

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

}  // namespace

Checksum::Checksum(const Parameters& parameters) : parameters_(parameters) {
  const std::size_t width = 8 * parameters_.bytes;
  for (std::uint32_t byte = 0; byte < table_.size(); ++byte) {
    if (parameters_.kind == Kind::weiss) {
      table_[byte] = most_significant_first(byte, 0x1021, 2);
    } else if (parameters_.reflect) {
      table_[byte] = reflected(
          most_significant_first(reflected(byte, 8), parameters_.polynomial, parameters_.bytes),
          width);
    } else {
      table_[byte] = most_significant_first(byte, parameters_.polynomial, parameters_.bytes);
    }
  }
}

std::uint32_t Checksum::operator()(std::span<const std::uint8_t> bytes) const {
  const std::size_t width = 8 * parameters_.bytes;
  const std::uint32_t mask = mask_of(parameters_.bytes);
  // Only a CRC has a beginning other than its parameter says: a reflected one turns it round too.
  const bool least_first = parameters_.kind == Kind::weiss || parameters_.reflect;
  std::uint32_t sum = parameters_.init & mask;
  switch (parameters_.kind) {
    case Kind::sum:
      for (const std::uint8_t byte : bytes) {
        sum += byte;
      }
      break;
    case Kind::exor:
      for (const std::uint8_t byte : bytes) {
        sum ^= byte;
      }
      break;
    case Kind::weiss:
      sum = 0xffff;
      [[fallthrough]];
    case Kind::crc:
      if (parameters_.kind == Kind::crc && parameters_.reflect) {
        sum = reflected(sum, width);
      }
      for (const std::uint8_t byte : bytes) {
        sum = least_first ? sum >> 8 ^ table_[(sum ^ byte) & 0xff]
                          : (sum << 8 & mask) ^ table_[(sum >> (width - 8) ^ byte) & 0xff];
      }
      break;
  }
  return (sum ^ parameters_.xor_out) & mask;
}

}  // namespace palpate
