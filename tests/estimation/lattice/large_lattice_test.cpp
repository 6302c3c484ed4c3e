#include <algorithm>
#include <numeric>

#include <gtest/gtest.h>

#include "gpu/context.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"

namespace palpate::large_lattice_test {

TEST(LargeLattice, FiveMillionBinsAreAsGoodAsTenThousand) {
  std::vector<Hypothesis> objects;
  for (const std::uint64_t seed : {131U, 132U, 133U, 134U, 135U}) {
    objects.push_back({random_map(61, 61, 0.5, 12.0, seed), 1.0});
  }
  HistogramOptions options;
  options.lattice = {
      .x_mm = {-10.0, 10.0, 100}, .y_mm = {-10.0, 10.0, 100}, .theta_rad = {0.0, two_pi, 100}};
  const Recording recording = random_recording(6, 36, 136);
  const std::vector<Touch> touches = all_touches(recording);
  // A GPU would be done before there is any progress.
  Device device = Device::open();
  gpu::Limits limits = device.context().limits();
  limits.cpu = true;
  device.context().lower_limits(limits);
  PoseHistogram histogram(device, objects, options);
  double done = 0.0;
  histogram.update(touches, [&](double fraction) {
    EXPECT_GT(fraction, done);
    EXPECT_LE(fraction, 1.0);
    done = fraction;
  });
  EXPECT_GT(done, 0.5) << "no progress was reported";
  const auto all_bins = static_cast<std::uint64_t>(5 * options.lattice.bins());
  EXPECT_LT(histogram.device_bytes(), 16 * all_bins);

  Uniform random(137);
  const Estimate estimate = histogram.estimate();
  double best = -infinity;
  for (std::size_t object = 0; object < 5; ++object) {
    const std::vector<double> product = histogram.log_likelihood(static_cast<int>(object));
    best = std::max(best, std::ranges::max(product));
    for (int sample = 0; sample < 1000; ++sample) {
      const auto bin = static_cast<std::int64_t>(random(0.0, 1e6));
      const Pose pose = reference::bin_pose(options.lattice, bin);
      double expected = 0.0;
      for (const Touch& touch : touches) {
        expected += reference::log_likelihood(touch, pose, objects[object].map, {});
      }
      ASSERT_NEAR(product[static_cast<std::size_t>(bin)], expected, 6 * per_touch)
          << "object " << object << ", bin " << bin;
    }
    const std::vector<double> theta = histogram.marginals(static_cast<int>(object)).theta;
    // Each theta is a sum of float32 parts of 512 terms.
    EXPECT_NEAR(std::accumulate(theta.begin(), theta.end(), 0.0), estimate.identity[object], 1e-5);
  }
  EXPECT_EQ(estimate.mode.log_likelihood, best);
}

}  // namespace palpate::large_lattice_test
