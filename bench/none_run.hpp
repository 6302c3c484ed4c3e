#pragma once

#include <span>
#include <string>
#include <vector>

#include "palpate/lattice.hpp"
#include "palpate/pose_histogram.hpp"
#include "palpate/touch.hpp"

namespace palpate::bench {

/// Shapes that nobody learned. T and F share strokes with I and E, and the ring is an O of another
/// size.
inline const std::vector<std::string> unlearned_shapes = {"F", "H", "T", "X", "ring"};

/// Which unknowns are called "none of these" after a number of touches, for any prior weight of
/// that hypothesis.
struct NoneRun {
  int touches = 0;
  /// Of every trial, log10 of the weight above which "none" is more probable than every learned
  /// object, each of which has weight 1.
  std::vector<double> learned_log10_weight;
  std::vector<double> unlearned_log10_weight;

  /// Fraction of the learned objects that are called none at a weight.
  double lost(double log10_weight) const;
  /// Fraction of the unlearned ones that are.
  double noticed(double log10_weight) const;
  /// How often an unlearned object turns before a learned one, over all pairs (the area under the
  /// curve of `noticed` over `lost`): 0.5 is chance, 1 means that some weight tells all apart.
  double separation() const;
};

/// The histogram filter over the given lattice, after each of these numbers of touches in turn.
std::vector<NoneRun> run_none(Device& device, std::span<const Hypothesis> letters,
                              std::span<const Recording> learned_trials,
                              std::span<const Recording> unlearned_trials,
                              const PoseLattice& lattice, std::span<const int> touches);

}  // namespace palpate::bench
