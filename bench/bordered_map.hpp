#pragma once

#include <span>
#include <vector>

#include "interface.h"
#include "palpate/lattice.hpp"
#include "palpate/pose_histogram.hpp"

namespace palpate::bench {

/// What the baselines read of a map: its log odds within a border of prior, so that a clamped index
/// finds the prior beyond the map, and the lattice's axes in its cells.
struct BorderedMap {
  double cell_mm = 0.0;
  int width = 0;
  int height = 0;
  std::vector<float> log_odds;       ///< [height, width]
  std::vector<shaders::Split> axes;  ///< nx of x, then ny of y
};

std::vector<BorderedMap> bordered_maps(std::span<const Hypothesis> hypotheses,
                                       const PoseLattice& lattice, double prior);

// Elements summed in one float, as in the product.
inline constexpr std::size_t segment_elements = 64;

}  // namespace palpate::bench
