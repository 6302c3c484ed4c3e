#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "filter_run.hpp"

namespace palpate::bench {

/// How far log-likelihoods are from float64, in nats per touch.
struct Deviation {
  double largest = 0.0;
  double rms = 0.0;
  int samples = 0;
};

/// One filter of one size on maps of one cell size: what it costs and what it is worth.
struct SweepPoint {
  std::string filter;  ///< "histogram", "particles" or "augmented"
  double cell_mm = 0.0;
  std::int64_t count = 0;        ///< bins per object, or particles in all
  std::array<int, 3> bins{};     ///< along x, y and theta; zeros for particles
  bool balanced = false;         ///< bins in the proportions of the goal's lattice
  std::string path;              ///< how the likelihood is evaluated
  double seconds_touch = 0.0;    ///< median, from a touch to the estimate
  double seconds_unknown = 0.0;  ///< median, of all touches of a trial with an estimate each
  std::uint64_t device_bytes = 0;
  std::vector<Score> scores;  ///< after the last touch, [trial], letter by letter
  CurvePoint last;            ///< over all trials after the last touch
  double calibration_error = 0.0;
  /// Mean error of the bins nearest to the truth, the least that a mode can have; of histograms.
  std::optional<double> nearest_bin_mm = {};
  std::optional<Deviation> deviation = {};
};

/// All trials by the histogram. The refined pose is taken after the last touch and not timed.
SweepPoint measure_histogram(Device& device, const LearnedLetters& learned,
                             std::span<const Recording> trials, const PoseLattice& lattice);

/// All trials by the particle filter or Augmented MCL; trial i has the seed options.seed + i. The
/// deviation is that of the weights after one touch, which nothing has resampled yet.
SweepPoint measure_particles(Device& device, const LearnedLetters& learned,
                             std::span<const Recording> trials, ParticleOptions options);

/// One way to evaluate the likelihood: its time and its deviation from float64.
struct Precision {
  std::string path;
  std::int64_t count = 0;    ///< bins per object, or particles in all
  double nanoseconds = 0.0;  ///< per pose, element and touch
  Deviation deviation;
};

/// The engine's way for this lattice and the two baselines, the one-bin kernel and the loop on the
/// host's cores, side by side: the likelihood alone, without reductions.
std::vector<Precision> compare_paths(Device& device, const LearnedLetters& learned,
                                     const Recording& unknown, int touches,
                                     const PoseLattice& lattice);

}  // namespace palpate::bench
