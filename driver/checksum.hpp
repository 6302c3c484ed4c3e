#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace palpate {

/// A checksum of 1, 2 or 4 bytes over part of a packet.
class Checksum {
 public:
  enum class Kind : std::uint8_t {
    sum,    ///< of the bytes
    exor,   ///< of the bytes
    crc,    ///< Rocksoft parameters: width, polynomial, init, reflect (in and out), xor_out
    weiss,  ///< Weiss Robotics': 16 bits; the table of CRC-16 0x1021, run as if it were reflected
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

 private:
  Parameters parameters_;
  std::array<std::uint32_t, 256> table_ = {};  // of one byte, for the two kinds of CRC
};

}  // namespace palpate
