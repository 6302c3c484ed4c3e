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
    sum,    ///< sum of the bytes
    exor,   ///< exclusive or of the bytes
    crc,    ///< CRC by Rocksoft's parameters below; `reflect` covers its input and its output
    weiss,  ///< Weiss Robotics' 16 bits: CRC-16 0x1021's table, indexed as in a reflected CRC
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

  /// Computes the checksum of a stretch of a stream in at most 18 short steps from the stream's
  /// run_on() values in front of the stretch (`before`) and behind it (`end`).
  /// @param bytes length of the stretch, at most longest_stretch
  std::uint32_t of_stretch(std::uint32_t before, std::uint32_t end, std::size_t bytes) const;
  static constexpr std::size_t longest_stretch = (std::size_t{1} << 18) - 1;

  /// The running value of a stream after one more byte. The stream may begin with any value.
  std::uint32_t run_on(std::uint32_t running, std::uint8_t byte) const;

 private:
  using Map = std::array<std::uint32_t, 32>;  // linear map of a register: the image of each bit

  std::uint32_t begin() const;
  std::uint32_t over_zeros(std::uint32_t running, std::size_t bytes) const;

  Parameters parameters_;
  std::uint32_t mask_ = 0;
  std::vector<Map> zeros_;                     // [k]: what 2^k zero bytes do to the register
  std::array<std::uint32_t, 256> table_ = {};  // [byte], for crc and weiss
};

}  // namespace palpate
