#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "palpate/pose_histogram.hpp"
#include "synthetic.hpp"

namespace palpate {
namespace {

constexpr double two_pi = 2.0 * std::numbers::pi;

// What the method allows a log-likelihood to differ from float64, in nats per touch.
constexpr double per_touch = 1e-4;

HistogramOptions small_options() {
  HistogramOptions options;
  options.lattice = {.x_mm = {-5.0, 6.0, 9}, .y_mm = {-7.0, 4.0, 8}, .theta_rad = {0, two_pi, 5}};
  return options;
}

TEST(Accuracy, DoesNotDecayOverAHundredTouches) {
  const Hypothesis hypothesis{random_map(31, 27, 0.5, 12.0, 71), 1.0};
  const Recording recording = random_recording(100, 36, 72);
  const HistogramOptions options = small_options();
  Device device = Device::open();
  PoseHistogram histogram(device, std::span(&hypothesis, 1), options);
  for (std::size_t touches = 1; touches <= recording.size(); ++touches) {
    histogram.update(recording.touch(touches - 1));
    if (touches != 1 && touches != 10 && touches != 50 && touches != 100) {
      continue;
    }
    const double error = likelihood_error(
        histogram,
        reference_posterior(std::span(&hypothesis, 1), options, recording.touches(0, touches)));
    EXPECT_LT(error, per_touch * static_cast<double>(touches)) << touches << " touches";
    if (touches == 50) {
      // All elements summed in one float32 would be off by 4e-2 by now.
      EXPECT_LT(error, 2e-3);
    }
  }
}

TEST(Accuracy, HoldsForSteepMaps) {
  // Interpolation in float32 between -130 and 130 errs by 3e-5 nats, but only the few elements
  // that lie where the likelihood is steep feel it.
  const Hypothesis hypothesis{random_map(31, 27, 0.5, 130.0, 73), 1.0};
  const Recording recording = random_recording(3, 36, 74);
  const HistogramOptions options = small_options();
  Device device = Device::open();
  PoseHistogram histogram(device, std::span(&hypothesis, 1), options);
  histogram.update(all_touches(recording));
  EXPECT_LT(likelihood_error(histogram, reference_posterior(std::span(&hypothesis, 1), options,
                                                            all_touches(recording))),
            3.0 * per_touch);
}

TEST(Accuracy, WithoutGammaIsRelativeToTheNatsThatATouchCosts) {
  // Without a floor a touch on a steep map costs thousands of nats, of which float32
  // interpolation keeps seven digits.
  const Hypothesis hypothesis{random_map(31, 27, 0.5, 130.0, 75), 1.0};
  const Recording recording = random_recording(1, 36, 76);
  HistogramOptions options = small_options();
  options.gamma = 0.0;
  Device device = Device::open();
  PoseHistogram histogram(device, std::span(&hypothesis, 1), options);
  histogram.update(all_touches(recording));
  const std::vector<double> expected = reference::log_likelihoods(
      all_touches(recording), options.lattice, hypothesis.map, {}, {.gamma = 0.0, .prior = 0.2});
  const std::vector<double> product = histogram.log_likelihood(0);
  for (std::size_t bin = 0; bin < expected.size(); ++bin) {
    ASSERT_NEAR(product[bin], expected[bin], per_touch + 3e-7 * std::abs(expected[bin]));
  }
}

TEST(Accuracy, WithoutGammaAnImpossibleElementCostsItsLogOdds) {
  OccupancyGrid map = random_map(40, 40, 0.5, 0.0, 77);
  map.log_odds.assign(map.log_odds.size(), -1000.0F);
  const Hypothesis hypothesis{map, 1.0};
  HistogramOptions options;
  options.lattice = {.x_mm = {0, 0, 1}, .y_mm = {0, 0, 1}, .theta_rad = {0, 0, 1}};
  options.gamma = 0.0;
  Device device = Device::open();
  PoseHistogram histogram(device, std::span(&hypothesis, 1), options);
  Recording recording;
  recording.T_robot_sensor.resize(1);
  recording.elements_mm = {{0.0, 0.0}, {1.0, 1.0}};
  recording.pressure = {10.0, 0.0};  // In Contact where nothing is; No Contact is certain
  histogram.update(all_touches(recording));
  EXPECT_NEAR(histogram.log_likelihood(0)[0], -1000.0, 2e-4)
      << "the last float32 digit at 1,000 is 6e-5";
}

TEST(Accuracy, DoesNotDependOnWhereTheRobotsOriginLies) {
  const Hypothesis hypothesis{random_map(31, 27, 0.5, 12.0, 78), 1.0};
  const Recording near = random_recording(4, 36, 79);
  const Pose T_far_near{{700.0, -714.0}, 0.0};
  HistogramOptions options = small_options();
  Device device = Device::open();
  PoseHistogram at_origin(device, std::span(&hypothesis, 1), options);
  at_origin.update(all_touches(near));
  options.lattice.pivot_mm = T_far_near.translation_mm;
  PoseHistogram far_away(device, std::span(&hypothesis, 1), options);
  far_away.update(all_touches(moved(near, T_far_near)));
  EXPECT_LT(largest_difference(at_origin.log_likelihood(0), far_away.log_likelihood(0)), per_touch);
}

}  // namespace
}  // namespace palpate
