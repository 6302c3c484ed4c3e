#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "displacement_population.hpp"
#include "palpate/displacement.hpp"
#include "recogniser.hpp"

namespace palpate {

/// An object and the touches that it was touched with.
struct TouchedObject {
  std::string name;  ///< of its recording, for messages
  std::vector<Touch> touches;
  std::string label;  ///< of the object where it is known; "" otherwise
};

struct TouchSdFitOptions {
  /// Where the search begins: with large displacements, so that every pose that may explain the
  /// touches is among the samples.
  DisplacementSd start{2.0, 0.1};
  std::size_t samples = 64;  ///< of every unknown's posterior
  int sweeps = 20;           ///< by which every sample moves in every step of the search
  std::uint64_t seed = 0;
};

/// Standard deviations of the touches' poses.
struct TouchSdFit {
  DisplacementSd sd;
  DisplacementSd standard_error;
  /// By how much the log evidence exceeds that of exact poses, in nats.
  double evidence_gain = 0.0;
  std::size_t unknowns = 0;
  std::size_t touches = 0;
};

/// Standard deviations with the largest evidence over all unknowns, by samples of every unknown's
/// posterior.
TouchSdFit fit_touch_sd(std::vector<DisplacementPopulation>& unknowns,
                        ReadingModel& readings, const TouchSdFitOptions& options,
                        const std::function<void(double)>& progress = {});

}  // namespace palpate
