#include <cmath>

#include <gtest/gtest.h>

#include "hard_case.hpp"

namespace palpate::weight_test {

HistogramOptions small_options() {
  HistogramOptions options;
  options.lattice = {.x_mm = {-5.0, 5.0, 5}, .y_mm = {-5.0, 5.0, 5}, .theta_rad = {0.0, 6.0, 4}};
  return options;
}

TEST(Weight, ExtremelyUnequal) {
  HardCase hard("prior weights of 1e-30 beside 1",
                "the light object's probability underflows before the touches speak for it",
                "weights join as logarithms in float64");
  std::vector<Hypothesis> objects{{random_map(31, 27, 0.5, 6.0, 471), 1.0},
                                  {random_map(31, 27, 0.5, 6.0, 472), 1e-30}};
  const Recording recording = random_recording(40, 36, 473);
  Device device = Device::open();
  const Estimate before = hard.expect_posterior(device, objects, small_options(), {});
  EXPECT_NEAR(before.identity[1], 1e-30, 1e-36) << "the weight itself, to six digits";

  // The object that the touches favour gets the small weight: the evidence must outweigh 69 nats.
  const Estimate equal = [&] {
    std::vector<Hypothesis> even = objects;
    even[1].weight = 1.0;
    return hard.expect_posterior(device, even, small_options(), all_touches(recording),
                                 {.nats = 5e-4, .near_top_nats = 8e-5});
  }();
  const int favoured = equal.mode.object;
  objects[static_cast<std::size_t>(favoured)].weight = 1e-30;
  objects[static_cast<std::size_t>(1 - favoured)].weight = 1.0;
  const Estimate after =
      hard.expect_posterior(device, objects, small_options(), all_touches(recording),
                            {.nats = 5e-4, .near_top_nats = 8e-5});
  const double ratio = std::log(equal.identity[static_cast<std::size_t>(favoured)]) -
                       std::log(equal.identity[static_cast<std::size_t>(1 - favoured)]);
  EXPECT_NEAR(std::log(after.identity[static_cast<std::size_t>(favoured)]) -
                  std::log(after.identity[static_cast<std::size_t>(1 - favoured)]),
              ratio - 30.0 * std::log(10.0), 1e-9);
}

TEST(Weight, AtTheEndsOfFloat64) {
  HardCase hard("prior weights of 1e308 and of 5e-324",
                "the sum of the weights is infinite, their ratio 0",
                "weights are taken relative to the largest before they are summed");
  const OccupancyGrid map = random_map(31, 27, 0.5, 6.0, 474);
  const Recording recording = random_recording(2, 36, 475);
  Device device = Device::open();
  PoseHistogram heavy(device, std::vector<Hypothesis>{{map, 1e308}, {map, 1.5e308}},
                      small_options());
  heavy.update(all_touches(recording));
  hard.expect("identity", std::abs(heavy.estimate().identity[1] - 0.6), 1e-12);
  EXPECT_TRUE(std::isfinite(heavy.estimate().mode.log_likelihood));
  EXPECT_EQ(heavy.estimate().mode.object, 1);
  PoseHistogram light(device, std::vector<Hypothesis>{{map, 5e-324}, {map, 5e-324}},
                      small_options());
  light.update(all_touches(recording));
  hard.expect("identity", std::abs(light.estimate().identity[1] - 0.5), 1e-12);
  EXPECT_EQ(light.estimate().mode.object, 0);
  PoseHistogram both(device, std::vector<Hypothesis>{{map, 5e-324}, {map, 1e308}}, small_options());
  both.update(all_touches(recording));
  hard.expect("identity", std::abs(both.estimate().identity[1] - 1.0), 1e-12);
}

}  // namespace palpate::weight_test
