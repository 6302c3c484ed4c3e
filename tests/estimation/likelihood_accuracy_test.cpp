#include <cmath>

#include <gtest/gtest.h>

#include "palpate/pose_histogram.hpp"
#include "support/synthetic.hpp"

namespace palpate::likelihood_accuracy_test {

HistogramOptions small_options() {
  HistogramOptions options;
  options.lattice = {.x_mm = {-5.0, 6.0, 9}, .y_mm = {-7.0, 4.0, 8}, .theta_rad = {0, two_pi, 5}};
  return options;
}

/// Bins of 0.1 mm take register tiles, bins of 1.6 mm runs.
class BinWidth : public testing::TestWithParam<double> {};

TEST_P(BinWidth, ErrorDoesNotGrowFasterThanTheTouches) {
  const Hypothesis hypothesis{random_map(31, 27, 0.5, 12.0, 71), 1.0};
  const Recording recording = random_recording(1000, 36, 72);
  HistogramOptions options;
  options.lattice = {.x_mm = {-5.0, -5.0 + 9 * GetParam(), 9},
                     .y_mm = {-7.0, -7.0 + 8 * GetParam(), 8},
                     .theta_rad = {0, two_pi, 2}};
  Device device = Device::open();
  PoseHistogram histogram(device, std::span(&hypothesis, 1), options);
  std::size_t done = 0;
  // All elements summed in one float32 would be off by 4e-2 nats after 50 touches.
  for (const auto& [touches, most] :
       {std::pair{1, per_touch}, std::pair{50, 1e-3}, std::pair{1000, 1e-2}}) {
    histogram.update(recording.touches(done, static_cast<std::size_t>(touches)));
    done = static_cast<std::size_t>(touches);
    const double error = likelihood_error(
        histogram,
        reference_posterior(std::span(&hypothesis, 1), options, recording.touches(0, done)));
    EXPECT_LT(error, most) << touches << " touches";
  }
}

INSTANTIATE_TEST_SUITE_P(Millimetres, BinWidth, testing::Values(0.1, 0.2, 1.6));

TEST(Accuracy, HoldsForMoreElementsThanALoopMayCount) {
  // lavapipe ends a kernel's loops after 65,535 iterations; one theta leaves room for more elements
  // than that in a table.
  const Hypothesis hypothesis{random_map(31, 27, 0.5, 12.0, 75), 1.0};
  const Recording recording = random_recording(100, 1400, 76);
  Device device = Device::open();
  for (const double step_mm : {0.1, 1.6}) {
    HistogramOptions options;
    options.lattice = {.x_mm = {0.0, 4 * step_mm, 4}, .y_mm = {0.0, step_mm, 1}, .theta_rad = {}};
    PoseHistogram histogram(device, std::span(&hypothesis, 1), options);
    histogram.update(all_touches(recording));
    EXPECT_LT(likelihood_error(histogram, reference_posterior(std::span(&hypothesis, 1), options,
                                                              all_touches(recording))),
              per_touch * 100 * 1400 / 36.0);
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
  options.contact.gamma = 0.0;
  Device device = Device::open();
  PoseHistogram histogram(device, std::span(&hypothesis, 1), options);
  histogram.update(all_touches(recording));
  const std::vector<double> expected = reference::log_likelihoods(
      all_touches(recording), options.lattice, hypothesis.map, options.contact);
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
  options.contact.gamma = 0.0;
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

}  // namespace palpate::likelihood_accuracy_test
