#pragma once

#include <cstddef>
#include <numbers>
#include <vector>

#include "learning/press.hpp"
#include "palpate/contact.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// Steps of theta at which presses at unknown poses are placed; those of x and y are the elements'
/// spacing.
inline constexpr double placing_step_rad = std::numbers::pi / 18.0;

/// Bins half an element's spacing and 5 degrees wide over the places of the arrays' centres, with
/// room for a bin around them.
/// @param presses at known poses, at least one
PoseLattice fine_lattice(const std::vector<Press>& presses, double spacing_mm);

/// @param presses at known poses
/// @throws Error on an array whose centre is more than a bin beyond the lattice's x or y
void require_within(const std::vector<Press>& presses, const PoseLattice& lattice);

/// What it may cost to try presses on bins, alone and in groups.
struct TrialCost {
  std::size_t maps = 0;     ///< on which each press is tried
  double spacing_mm = 0.0;  ///< of the elements
  double minutes = 0.0;     ///< of one core
};

/// The lattice, or as fine a one of its region as the cost allows, but not coarser than presses at
/// unknown poses are placed.
/// @throws Error where even that would take too long, or too much memory
PoseLattice affordable_lattice(PoseLattice lattice, const std::vector<Press>& presses,
                               const ContactClassifier& classifier, const TrialCost& cost);

}  // namespace palpate
