#pragma once

#include <vector>

#include "palpate/contact_model.hpp"
#include "palpate/pose_histogram.hpp"
#include "report.hpp"

namespace palpate::bench {

/// What all cases work on.
struct Inputs {
  Device& device;
  bool quick = false;  ///< small sizes, next to no repeats
  std::vector<Recording> training;
  std::vector<Hypothesis> letters;  ///< maps of 0.5 mm cells
  ContactModel model;               ///< that of the letters' histograms
  std::vector<Recording> unknowns;  ///< of touches_per_unknown touches
};

/// Whether identity and mode are the same to the last digit.
bool same(const Estimate& a, const Estimate& b);

/// An empty histogram of the letters.
PoseHistogram letter_histogram(const Inputs& inputs, const PoseLattice& lattice);

/// Times the letters' maps at cells of 0.1 mm, with their error.
Case fine_map_case(const Inputs& inputs);

/// Streams very many touches of one spot, or from all over a letter, into one map: time, memory and
/// error.
Case map_stream_case(const Inputs& inputs, bool one_spot);

/// Times the recognition of many unknown objects in turn, in one process and in a process each.
Case many_unknowns_case(const Inputs& inputs);

/// The blocks of poses that one search by bounds goes into after 1, 3 and 9 touches, for a picture.
Json search_by_bounds(const std::vector<Hypothesis>& letters, bool quick);

}  // namespace palpate::bench
