#pragma once

#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/pose_histogram.hpp"
#include "support/synthetic.hpp"

namespace palpate {

// Beliefs that are updated touch by touch, by their definitions in float64.

/// What the method allows a mean likelihood to differ from float64, in nats per touch.
inline constexpr double per_mean = 1e-3;

using Logs = std::vector<double>;

/// Two maps of random log odds, with weights of 2 and 1.
const std::vector<Hypothesis>& two_maps();

/// A lattice on which an array near the origin meets both maps at most bins.
PoseLattice small_lattice();

/// [touch][object][bin]: every touch's likelihood, averaged where touches are uncertain.
std::vector<std::vector<Logs>> reference_touches(const HistogramOptions& options,
                                                 std::span<const Touch> touches);

/// The belief after touches of these likelihoods.
reference::Posterior expected_posterior(const HistogramOptions& options,
                                        std::span<const std::vector<Logs>> logs);
reference::Posterior expected_posterior(const HistogramOptions& options,
                                        std::span<const Touch> touches);

/// The log odds of "none of these", by its definition and by a histogram. Its own evidence takes
/// touches as if they lay where the robot says.
/// @param by_touch likelihoods of these touches and perhaps of more
double expected_log_odds_of_none(const HistogramOptions& options, std::span<const Touch> touches,
                                 const std::vector<std::vector<Logs>>& by_touch);
double log_odds_of_none(const PoseHistogram& histogram);

class TouchByTouchTest : public testing::Test {
 protected:
  /// Elements over [-6, 6]^2 mm, poses over [-8, 8]^2 mm.
  const Recording recording = random_recording(3, 40, 73);
  const std::vector<Touch> touches = all_touches(recording);
  Device device = Device::open();
};

}  // namespace palpate
