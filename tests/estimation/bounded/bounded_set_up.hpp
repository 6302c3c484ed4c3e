#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "palpate/bounded_posterior.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"

namespace palpate {

/// The shape of an L, and a disc of twice its weight.
const std::vector<Hypothesis>& two_shapes();

/// Two maps of random cells, the second of three times the first one's weight.
const std::vector<Hypothesis>& two_made_up();

/// 13 x 12 x 16 bins.
BoundedOptions small_options();
/// These where touches are uncertain by 1 mm and 0.2 rad.
BoundedOptions uncertain_options();

/// Touches of the L, at one pose.
Recording touches_of_l(std::size_t touches, std::uint64_t seed);

double sum(std::span<const double> values);

/// The options of a histogram over the same bins, displacements and "none of these".
HistogramOptions dense_options(const BoundedOptions& options);

/// A posterior by bounds, and a histogram of the same bins.
struct BothFilters {
  BothFilters(Device& device, const std::vector<Hypothesis>& objects,
              const BoundedOptions& options);
  void update(const Touch& touch);

  BoundedPosterior bounded;
  PoseHistogram dense;
};

}  // namespace palpate
