#pragma once

#include <string>
#include <vector>

#include "palpate/pose_histogram.hpp"
#include "palpate/sensor_model.hpp"
#include "report.hpp"

namespace palpate::bench {

/// What all cases work on.
struct Inputs {
  Device& device;
  std::string device_name;  ///< as asked for, for processes that open it anew; may be empty
  bool quick = false;       ///< small sizes, a few repeats
  std::vector<Recording> training;
  std::vector<Hypothesis> letters;  ///< maps of 0.5 mm cells
  ContactLikelihood model;          ///< that of the letters' histograms
  std::vector<Recording> unknowns;  ///< of touches_per_unknown touches
};

/// An empty histogram of the letters.
PoseHistogram letter_histogram(const Inputs& inputs, const PoseLattice& lattice);

/// Likelihood of an unknown's touches on a lattice, with its error and against two baselines, the
/// straightforward kernel and the CPU loop. Leaves the histogram with some touches in it.
Case likelihood_case(const Inputs& inputs, PoseHistogram& histogram, double goal_ns);

/// Error of the likelihood after 1, 50 and 1,000 touches.
Case accuracy_case(const Inputs& inputs, const PoseLattice& lattice);

/// Identity, mode and marginals of a belief.
Case reduction_case(const Inputs& inputs, PoseHistogram& histogram);

/// The letters' maps at 0.1 mm cells.
Case fine_map_case(const Inputs& inputs);

/// Very many touches streamed into one map, of one spot or from all over the letter.
Case map_stream_case(const Inputs& inputs, bool one_spot);

/// Many unknown objects one after the other, in one process and in a process each.
Case many_unknowns_case(const Inputs& inputs);

/// From one touch to the estimate.
Case latency_case(const Inputs& inputs);

}  // namespace palpate::bench
