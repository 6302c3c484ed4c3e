// Maps without doubt, whose likelihoods are 0 in float64, and touches that contradict them.

#include <gtest/gtest.h>

#include "hard_case.hpp"

namespace palpate::contradiction_test {

/// A map without doubt: the log odds of every cell are +1,000 or -1,000.
OccupancyGrid certain_map(std::uint64_t seed) {
  OccupancyGrid map = random_map(41, 41, 0.5, 1.0, seed);
  for (float& l : map.log_odds) {
    l = l > 0.0F ? 1000.0F : -1000.0F;
  }
  return map;
}

OccupancyGrid filled_map(float log_odds) {
  OccupancyGrid map = random_map(41, 41, 0.5, 1.0, 411);
  map.log_odds.assign(map.log_odds.size(), log_odds);
  return map;
}

HistogramOptions with_gamma(double gamma) {
  return {.lattice = {{-3.0, 3.0, 5}, {-3.0, 3.0, 6}, {0.0, 6.0, 4}, {}},
          .contact = {.gamma = gamma}};
}

// Interpolation between -1,000 and 1,000 keeps the seven digits of float32: an error of 1e-4 nats
// per element. The sum adds 36 roundings.
constexpr Allowed seven_digits{.nats = 2e-3, .relative = 3e-7};

/// A touch of the map's middle with 35 elements of this pressure and one of `first`.
Recording press(double pressure, double first = 10.0) {
  Recording recording;
  recording.T_robot_sensor.push_back({{0.5, -0.25}, 0.3});
  for (int i = 0; i < 36; ++i) {
    recording.elements_mm.emplace_back(0.2 * (i % 6), 0.2 * (i / 6));  // NOLINT: whole rows
    recording.pressure.push_back(i == 0 ? first : pressure);
  }
  return recording;
}

TEST(Contradiction, CertainMapsWithoutGammaOrWithAFloorThatNoFloatHolds) {
  HardCase hard("gamma = 0 on maps at log odds of +-1,000");
  HardCase floor("gamma of 1e-30, 1e-42 and 1e-300 on maps at log odds of +-1,000");
  HardCase bounds("bounds: gamma = 0 on maps at log odds of +-1,000");
  const std::vector<Hypothesis> objects{{certain_map(412), 1.0}, {certain_map(413), 1.0}};
  const Recording recording = random_recording(4, 36, 414);
  for (const double bins_mm : {0.4, 6.0}) {
    for (const double gamma : {0.0, 1e-300, 1e-42, 1e-30, 0.1}) {
      HistogramOptions options = with_gamma(gamma);
      options.lattice.x_mm.upper = options.lattice.x_mm.lower + bins_mm;
      options.lattice.y_mm.upper = options.lattice.y_mm.lower + bins_mm;
      if (gamma < 0.1) {
        (gamma == 0.0 ? hard : floor)
            .expect_posterior(objects, options, all_touches(recording), seven_digits);
      }
      // A place is known to 1e-15 mm, which is worth 4e-12 nats at 4,000 nats a mm.
      bounds.expect_laws(objects, options, recording, 1e-7);
    }
  }
}

TEST(Contradiction, OfEveryHypothesisByPiecesOfThem) {
  HardCase hard("gamma = 0 and touches of pieces that no single hypothesis has");
  const std::vector<Hypothesis> objects{{filled_map(-1000.0F), 1.0}, {filled_map(1000.0F), 1.0}};
  HistogramOptions options = with_gamma(0.0);
  options.none_weight = 1e-30;
  PoseHistogram histogram(shared_device(), objects, options);
  // One object explains the first touch, and the other one the second.
  histogram.update(all_touches(press(10.0)));
  EXPECT_LT(histogram.estimate().none, 1e-29);
  histogram.update(all_touches(press(0.0, 1.9)));  // Unknown, and No Contact beside it
  EXPECT_EQ(histogram.estimate().none, 1.0);
  EXPECT_EQ(histogram.estimate().identity, (std::vector{0.0, 0.0}));
  EXPECT_TRUE(histogram.estimate().contradicted);
}

TEST(Contradiction, LogOddsAtTheLargestThatAMapMayHold) {
  HardCase hard("log odds of +-1e30, gamma 0 and 0.1");
  HardCase bounds("bounds: log odds of +-1e30, gamma 0 and 0.1");
  const std::vector<Hypothesis> objects{{filled_map(-1e30F), 1.0}, {filled_map(1e30F), 1.0}};
  for (const double gamma : {0.0, 0.1}) {
    for (const double pressure : {0.0, 10.0}) {
      const Recording recording = press(pressure);
      // All bins of an object are equal, and the objects differ as much as possible.
      hard.expect_posterior(objects, with_gamma(gamma), all_touches(recording),
                            {.nats = 2e-3, .relative = 3e-7, .near_top_nats = 2e-3});
      // 1e31 nats keep 16 digits. With a floor the likelihood is near exact, but rounding that may
      // move such log odds by more than the floor's depth proves nothing: all may be missing.
      bounds.expect_laws(objects, with_gamma(gamma), recording, gamma > 0.0 ? 1.0 : 1e16);
    }
  }
}

}  // namespace palpate::contradiction_test
