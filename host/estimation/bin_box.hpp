#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

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

/// The number of bins of some boxes together.
inline std::size_t bins_in(std::span<const BinBox> boxes) {
  std::size_t bins = 0;
  for (const BinBox& box : boxes) {
    bins += static_cast<std::size_t>(box.bins());
  }
  return bins;
}

/// All bins of an object at one theta.
inline BinBox whole_plane(const PoseLattice& lattice, int theta, int object = 0) {
  return {.object = object,
          .theta = theta,
          .y_count = lattice.y_mm.count,
          .x_count = lattice.x_mm.count};
}

/// Takes bins of a belief, one box after another, with their log-likelihoods [y, x] in nats; a
/// single number stands for all bins of its box.
using BinVisitor = std::function<void(const BinBox&, std::span<const double>)>;

/// Which blocks of a belief, of a few thousand bins of one object each, a visit reads.
struct BlockChoice {
  /// Share of its object's belief below which a block may be left out.
  double least_share = 0.0;
  /// Whether to read a block of this object that holds this share of the object's belief: asked of
  /// each block in the order of the visit. The mean likelihood stands for all bins of others.
  std::function<bool(std::size_t object, double share)> reads = {};
};

/// The log-likelihoods of bins in nats, box after box, each [y, x]: read from a dense belief or
/// evaluated on demand.
using BoxLogLikelihood = std::function<std::vector<double>(std::span<const BinBox>)>;

}  // namespace palpate
