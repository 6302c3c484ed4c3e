#pragma once

#include <cstdint>
#include <span>

namespace palpate {

/// The bytes of values of this shape and width; UINT64_MAX on overflow.
inline std::uint64_t stored_bytes(std::span<const std::uint64_t> shape, std::uint64_t width) {
  std::uint64_t bytes = width;
  for (const std::uint64_t extent : shape) {
    if (__builtin_mul_overflow(bytes, extent, &bytes)) {
      return UINT64_MAX;
    }
  }
  return bytes;
}

}  // namespace palpate
