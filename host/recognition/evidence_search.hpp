#pragma once

#include <functional>
#include <vector>

#include "recognition/displacement_population.hpp"

namespace palpate {

/// The result of find_largest_evidence().
struct LargestEvidence {
  DisplacementSd sd;              ///< 0 where the search ended at the least
  DisplacementSd standard_error;  ///< 0 where sd is 0
  double gain = 0.0;              ///< of the log evidence over that at the least, in nats
  bool ended = false;             ///< false: still moving after the last step
};

/// Where the search for the largest evidence goes.
struct SearchRange {
  DisplacementSd start;
  DisplacementSd least;  ///< hardly distinguishable from 0
  int sweeps = 20;       ///< of every step
};

/// Climbs the log evidence of all unknowns over (log mm, log rad) by Newton's method. A step is no
/// longer than the samples' weights allow, about half the standard deviation of the unknowns'
/// likelihoods in it. After every step the readings' model learns from the samples (expectation
/// maximisation: Dempster, Laird and Rubin 1977). The result is the mean of the steps about the
/// largest evidence.
/// @param unknowns of which each has samples by range.start
/// @param progress called after every step with an estimate of the fraction done
LargestEvidence find_largest_evidence(std::vector<DisplacementPopulation>& unknowns,
                                      ReadingModel& readings, const SearchRange& range,
                                      const std::function<void(double)>& progress);

}  // namespace palpate
