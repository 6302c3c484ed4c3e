#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <vector>

#include "support/certified.hpp"

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

Recording first_touches(const Recording& recording, std::size_t touches);

/// Expects the certificate to hold after a trial's touches, each followed by an estimate within a
/// budget, for each of these budgets.
void expect_certified_within(Trial trial, std::initializer_list<double> budgets_s);

/// Runs trials and expects their certificates to hold; prints the largest error and certificate.
/// @param make what makes a trial
void expect_trials(const std::array<int, 3>& bins, int trials, std::uint64_t seed,
                   const decltype(make_trial)& make = make_trial);

}  // namespace palpate
