#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "palpate/bounded_posterior.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"

namespace palpate {

/// The shape of an L, and a disc of twice its weight.
const std::vector<Hypothesis>& two_shapes();

/// Two maps of random cells, the second of three times the first one's weight.
const std::vector<Hypothesis>& two_made_up();

/// 13 x 12 x 16 bins.
BoundedOptions small_options();

/// Touches of the L, at one pose.
Recording touches_of_l(std::size_t touches, std::uint64_t seed);

double sum(std::span<const double> values);

/// The options of a histogram over the same bins, displacements and "none of these".
HistogramOptions dense_options(const BoundedOptions& options);

/// Expects bounds to agree with the histogram about identities, "none of these", the mode, the
/// refined pose and the marginals, by what the method allows float32 after so many touches.
void expect_as_dense(BoundedPosterior& bounded, PoseHistogram& dense, std::size_t touches);

/// Expects the call to throw an Error of the user's input, in one line that says this.
void expect_refused(const std::function<void()>& call, const std::string& says);

}  // namespace palpate
