#pragma once

#include <span>
#include <vector>

#include "palpate/particle_filter.hpp"
#include "palpate/pose_histogram.hpp"
#include "sweep_plan.hpp"
#include "table.hpp"

namespace palpate::bench {

// What the sweep measures, each as records of its document.

/// Bins of every object, or particles for each, whose log-likelihood is held against float64.
inline constexpr int sampled_bins = 200;

/// What the histogram costs and what it is worth over `full`, which are the first of the trials of
/// every letter, equally many of each; where these are not all, the errors are those of all trials
/// in windows (estimate_in_window()).
Json measure_histogram(Device& device, const std::vector<Hypothesis>& letters,
                       std::span<const Recording> trials, std::span<const Recording> full,
                       const BinCounts& bins);

/// The same of the particle filter or Augmented MCL over all trials; trial i has the seed
/// options.seed + i. The deviation is that of the weights after one touch, which nothing has
/// resampled yet.
Json measure_particles(Device& device, const std::vector<Hypothesis>& letters,
                       std::span<const Recording> trials, ParticleOptions options);

/// Times the bounded posterior beside the histogram on one lattice, over all of the trials: asked
/// once after all touches, and after every touch. Holds its certificates against the histogram's
/// bins in float64, and says what --filter auto takes and whether it is the faster of the two where
/// they are asked once.
Json measure_bounds(Device& device, const std::vector<Hypothesis>& letters,
                    std::span<const Recording> trials, const BinCounts& bins);

/// Times the likelihood alone, without reductions, on one lattice, and its deviation from float64.
/// Returns a record of each way to evaluate it: the product of Eq. 7, the same in logs (gamma = 0),
/// an array at rest, the one-bin kernel, and the loop on the host's cores. The ways take turns.
/// @throws Error unless some touch of the unknown has at least half its elements in No Contact,
/// which an array at rest needs to gain anything
Json compare_paths(Device& device, std::span<const Hypothesis> letters, const Recording& unknown,
                   const PoseLattice& lattice);

/// Where the errors come from that more bins do not mend: changes one thing about the sensor, its
/// touches or the maps at a time and returns a record of each variant on each lattice, with pose
/// errors from windows (estimate_in_window()). Every variant is compared with the first, which
/// changes nothing, on the first of plan.limits; arrays, its own included, also run on the other
/// lattices, each compared with the same array on the first.
Json measure_limits(Device& device, const SweepPlan& plan);

}  // namespace palpate::bench
