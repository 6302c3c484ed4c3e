#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

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

  /// The same over a stretch of a stream in at most 18 short steps, however long it is, from two
  /// running values: that of all bytes before the stretch, and that of all bytes to its end.
  /// @param bytes of the stretch, at most longest_stretch
  std::uint32_t of_stretch(std::uint32_t before, std::uint32_t end, std::size_t bytes) const;
  static constexpr std::size_t longest_stretch = (std::size_t{1} << 18) - 1;

  /// The running value with one byte more. It begins at any value, the same for both ends.
  std::uint32_t run_on(std::uint32_t running, std::uint8_t byte) const;

 private:
  using Map = std::array<std::uint32_t, 32>;  // of a CRC's register: the image of each bit

  std::uint32_t begin() const;
  std::uint32_t over_zeros(std::uint32_t running, std::size_t bytes) const;

  Parameters parameters_;
  std::uint32_t mask_ = 0;
  std::vector<Map> zeros_;                     // what 1, 2, 4, ... bytes of zero do to the register
  std::array<std::uint32_t, 256> table_ = {};  // of one byte, for the two kinds of CRC
};

}  // namespace palpate
