#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "palpate/bounded_posterior.hpp"
#include "support/synthetic.hpp"

namespace palpate {

/// An unknown, its objects and its touches.
struct Trial {
  std::vector<Hypothesis> objects;
  BoundedOptions options;
  Recording recording;
};

/// A trial over a lattice of so many bins in x, y and theta: two to four objects, letters and
/// made-up maps in turn, of unequal weights and cells, under 1 to 9 touches.
Trial make_trial(const std::array<int, 3>& bins, std::uint64_t seed);

/// A trial as make_trial() has it where touches are displaced: by standard deviations from 0 to
/// beyond half the region, about pivots near and far, on lattices some of which have an axis of one
/// bin.
Trial make_displaced_trial(const std::array<int, 3>& bins, std::uint64_t seed);

}  // namespace palpate
