#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "measurement.hpp"
#include "palpate/lattice.hpp"
#include "palpate/particle_filter.hpp"
#include "pose_window.hpp"
#include "trial_errors.hpp"

namespace palpate::bench {

/// Bins of every object, or particles for each, whose log-likelihood is held against float64.
inline constexpr int sampled_bins = 200;

/// How far log-likelihoods of one touch are from float64, in nats.
struct Deviation {
  double largest = 0.0;
  double rms = 0.0;
  int samples = 0;
};
Deviation deviation_of(const ErrorStatistics& errors);

/// Poses by windows that the full posterior gave, too.
struct WindowCheck {
  int trials = 0;
  double mode_mm = 0.0;     ///< largest distance between the two modes, by the pose error
  double refined_mm = 0.0;  ///< the same of the refined poses
};

/// One filter of one size on maps of one cell size: what it costs and what it is worth.
struct SweepPoint {
  std::string filter;  ///< "histogram", "particles", "systematic" or "augmented"
  double cell_mm = 0.0;
  std::int64_t count = 0;     ///< bins per object, or particles in all
  std::array<int, 3> bins{};  ///< along x, y and theta; zeros for particles
  bool balanced = false;      ///< bins in the proportions of the goal's lattice
  std::string path;           ///< how the likelihood is evaluated

  // Of the trials with the full posterior.
  int full_trials = 0;
  double seconds_touch = 0.0;    ///< median, from a touch to the estimate
  double seconds_unknown = 0.0;  ///< median, of all touches of a trial with an estimate each
  std::optional<double> seconds_refine = {};  ///< median, of a refined pose after the last touch
  std::uint64_t device_bytes = 0;
  double accuracy = 0.0;          ///< fraction recognised after the last touch
  double least_confidence = 1.0;  ///< least probability of what they were recognised as
  double calibration_error = 0.0;

  std::vector<TrialErrors> errors;         ///< of all trials, letter by letter
  std::optional<WindowCheck> window = {};  ///< where the errors are from windows
  /// Mean error of the bins nearest to the truth, the least that a mode can have; of histograms.
  std::optional<double> nearest_bin_mm = {};
  Deviation deviation;
};

/// The histogram over `full`, which are the first of the trials of every letter, equally many of
/// each; where these are not all, the errors are those of all trials in windows.
SweepPoint measure_histogram(Device& device, const std::vector<Hypothesis>& letters,
                             std::span<const Recording> trials, std::span<const Recording> full,
                             const PoseLattice& lattice);

/// All trials by the particle filter or Augmented MCL; trial i has the seed options.seed + i. The
/// deviation is that of the weights after one touch, which nothing has resampled yet.
SweepPoint measure_particles(Device& device, const std::vector<Hypothesis>& letters,
                             std::span<const Recording> trials, ParticleOptions options);

}  // namespace palpate::bench
