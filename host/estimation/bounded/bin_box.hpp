#pragma once

#include <cstdint>

#include "palpate/lattice.hpp"

namespace palpate {

/// Neighbouring bins of one object and theta.
struct BinBox {
  std::int32_t object = 0;
  std::int32_t theta = 0;
  std::int32_t y_first = 0;
  std::int32_t y_count = 0;
  std::int32_t x_first = 0;
  std::int32_t x_count = 0;

  std::int64_t bins() const { return std::int64_t{y_count} * x_count; }
  /// The lattice's index of the i-th bin, [y, x].
  std::int64_t bin(std::int64_t i, const PoseLattice& lattice) const {
    const std::int64_t row = std::int64_t{theta} * lattice.y_mm.count + y_first + i / x_count;
    return row * lattice.x_mm.count + x_first + i % x_count;
  }
};

}  // namespace palpate
