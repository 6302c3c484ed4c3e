#include "driver/checksum.hpp"

#include <algorithm>
#include <bit>

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

}  // namespace palpate
