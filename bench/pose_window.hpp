#pragma once

#include <span>
#include <vector>

#include "palpate/device.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "palpate/pose_error.hpp"
#include "palpate/touch.hpp"
#include "recognition/recognition_record.hpp"

namespace palpate::bench {

/// An object and where it is.
struct PlacedBody {
  Body body;
  int symmetry = 1;  ///< as OccupancyGrid has it
  Pose T_object_robot;
};

/// The body of the letter that a trial is of, where the trial has it.
/// @throws Error where the letter was not learned
PlacedBody truth_of(std::span<const Hypothesis> letters, const Recording& trial);

/// Parts of a lattice, of the same bins, that together hold every bin within `reach_mm` of the body
/// by pose_error_mm(): one for each of its n places of equal error, or, for a body of full
/// symmetry, sectors of the circle. The lattice's theta is to cover the circle; a part's may go on
/// beyond its ends. Parts are boxes and may hold other bins besides.
std::vector<PoseLattice> windows_about(const PoseLattice& lattice, const PlacedBody& placed,
                                       double reach_mm);

/// Least error that a bin of the lattice has: what the lattice alone costs.
double nearest_bin_mm(const PoseLattice& lattice, const PlacedBody& placed);

/// How far from the truth a mode is looked for.
inline constexpr double window_reach_mm = 3.0;

/// Recognises a trial among the bins of its true object within `window_reach_mm` of the truth.
/// Where the full posterior has its mode there, mode and refined pose are the same but for
/// rounding, since no bin's likelihood depends on other bins; `identity` is that of one object
/// alone.
RecognitionStep estimate_in_window(Device& device, std::span<const Hypothesis> letters,
                                   const Recording& trial, const PoseLattice& lattice);

}  // namespace palpate::bench
