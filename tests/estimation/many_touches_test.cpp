#include <gtest/gtest.h>

#include "palpate/map_builder.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/synthetic.hpp"

// More elements in one call than a device loops over in one dispatch: llvmpipe silently ends an
// invocation's loops after 65,535 turns.

namespace palpate::many_touches_test {

TEST(ManyTouches, AtOnceCountAsMuchAsOneByOne) {
  const Hypothesis hypothesis{random_map(31, 27, 0.5, 12.0, 141), 1.0};
  const Recording recording = random_recording(3000, 36, 142);
  HistogramOptions options;
  options.lattice = {.x_mm = {-5, 6, 3}, .y_mm = {-7, 4, 2}, .theta_rad = {0, 6, 2}};
  Device device = Device::open();
  PoseHistogram at_once(device, std::span(&hypothesis, 1), options);
  at_once.update(all_touches(recording));
  EXPECT_LT(likelihood_error(at_once, reference_posterior(std::span(&hypothesis, 1), options,
                                                          all_touches(recording))),
            3000 * 1e-4)
      << "the method allows 1e-4 nats per touch";
}

TEST(ManyTouches, OfOneSpotAllCountInTheMap) {
  // A few touches are repeated over and over: the float64 sum of all is so many times theirs.
  constexpr int times = 2000;
  const Recording recording = random_recording(4, 36, 143);
  std::vector<Touch> touches;
  for (int i = 0; i < times; ++i) {
    for (const Touch& touch : all_touches(recording)) {
      touches.push_back(touch);
    }
  }
  const MapOptions options;
  Device device = Device::open();
  MapBuilder builder(device, options);
  builder.add(touches);
  const OccupancyGrid map = builder.build("made up");
  const std::vector<double> once =
      reference::log_odds_map(all_touches(recording), map, options.classifier, options.sensor);
  const double prior = map.prior_log_odds();
  for (std::size_t cell = 0; cell < once.size(); ++cell) {
    const double expected = prior + times * (once[cell] - prior);
    // 288,000 increments, each kept to a few parts in 1e7; equal ones err alike.
    ASSERT_NEAR(map.log_odds[cell], expected, 0.05) << "cell " << cell;
  }
}

}  // namespace palpate::many_touches_test
