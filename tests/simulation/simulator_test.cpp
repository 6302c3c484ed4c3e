#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "palpate/simulation.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"

namespace palpate::simulator_test {

/// A plate that every element of an array near its centre lies on entirely.
Shape plate() {
  return {.label = "plate",
          .strokes = {},
          .polygons = {{{-40.0, -40.0}, {40.0, -40.0}, {40.0, 40.0}, {-40.0, 40.0}}}};
}

/// The mean of values and their deviation from it, root mean square.
struct Spread {
  explicit Spread(std::span<const double> values) {
    const auto n = static_cast<double>(values.size());
    mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
    for (const double value : values) {
      sd += (value - mean) * (value - mean) / n;
    }
    sd = std::sqrt(sd);
  }

  double mean = 0.0;
  double sd = 0.0;
};

TEST(Simulator, FillsARecording) {
  Simulator simulator(make_shape("e"), {}, digitacts_array(), 1);
  const std::vector<Pose> poses = random_poses(4, 1);
  const Recording r = simulator.touch(poses, {});
  EXPECT_EQ(r.object, "E");
  EXPECT_EQ(r.pressure_unit, "kPa");
  EXPECT_EQ(r.rows, "touches");
  EXPECT_EQ(r.elements_mm, digitacts_array());
  EXPECT_EQ(r.time_s, (std::vector<double>{0.0, 0.5, 1.0, 1.5}));
  ASSERT_EQ(r.size(), 4U);
  EXPECT_EQ(r.elements(), 36U);
  EXPECT_EQ(r.T_robot_sensor[3].translation_mm, poses[3].translation_mm);
  EXPECT_FALSE(r.truth.has_value());
  EXPECT_TRUE(std::all_of(r.pressure.begin(), r.pressure.end(),
                          [](double p) { return std::isfinite(p) && p >= 0.0; }));
}

TEST(Simulator, SameSeedGivesTheSameRecordings) {
  const auto record_twice = [](std::uint64_t seed) {
    Simulator simulator(make_shape("A"), {}, digitacts_array(), seed);
    std::vector<double> both = simulator.touch(random_poses(5, 1), {}).pressure;
    const std::vector<double> second = simulator.touch(random_poses(5, 1), {}).pressure;
    EXPECT_NE(both, second) << "a second recording has its own forces and noise";
    both.insert(both.end(), second.begin(), second.end());
    return both;
  };
  EXPECT_EQ(record_twice(11), record_twice(11));
  EXPECT_NE(record_twice(11), record_twice(12));
}

TEST(Simulator, MovingObjectAndRobotFrameTogetherChangesNothing) {
  const Pose T_object_robot = random_object_pose(3);
  const Pose T_moved_robot{{412.0, -97.5}, 2.2};
  const std::vector<Pose> poses = random_poses(20, 3);
  std::vector<Pose> moved;
  for (const Pose& pose : poses) {
    moved.push_back(T_moved_robot * pose);
  }
  const auto pressure = [](const std::vector<Pose>& at, const Pose& from) {
    return Simulator(make_shape("R"), {}, digitacts_array(), 5).touch(at, from).pressure;
  };
  // Positions agree to 1e-12 mm, and the field rises by less than 20 kPa per mm.
  EXPECT_THAT(pressure(moved, T_object_robot * inverse(T_moved_robot)),
              testing::Pointwise(testing::DoubleNear(1e-9), pressure(poses, T_object_robot)));
}

TEST(Simulator, ForceVariesPerTouchAndGainPerElement) {
  constexpr int touches = 800;
  const SensorModel model{.force_spread = 0.15, .gain_spread = 0.05, .noise_kpa = 0.0};
  Simulator simulator(plate(), model, digitacts_array(), 21);
  const Recording r = simulator.touch(std::vector<Pose>(touches), {});
  std::vector<double> forces;
  for (int i = 0; i < touches; ++i) {
    const Touch touch = r.touch(i);
    forces.push_back(touch.pressure[0] / r.touch(0).pressure[0]);
    // One force for all elements, so the pattern of gains is the same in every touch; 1e-9:
    // rounding.
    for (std::size_t e = 1; e < 36; ++e) {
      ASSERT_NEAR(touch.pressure[e], forces.back() * r.touch(0).pressure[e], 1e-9);
    }
  }
  // Relative spread, five standard errors of it, 0.15 / sqrt(2 n).
  const Spread force(forces);
  EXPECT_NEAR(force.sd / force.mean, 0.15, 5.0 * 0.15 / std::sqrt(2.0 * touches));
  // Three standard errors of the spread of 36 gains, 0.05 / sqrt(72).
  const Spread gain(r.touch(0).pressure);
  EXPECT_NEAR(gain.sd / gain.mean, 0.05, 3.0 * 0.05 / std::sqrt(72.0));
}

TEST(Simulator, NoiseIsAdditiveAndClampedAtZero) {
  const SensorModel model{.force_spread = 0.0, .gain_spread = 0.0, .noise_kpa = 0.7};
  Simulator simulator(plate(), model, digitacts_array(), 4);
  constexpr double n = 400 * 36;
  const Spread on(simulator.touch(std::vector<Pose>(400), {}).pressure);
  // Five standard errors of a mean, sigma / sqrt(n), and of a deviation, sigma / sqrt(2 n).
  EXPECT_NEAR(on.mean, 20.0, 5.0 * 0.7 / std::sqrt(n));
  EXPECT_NEAR(on.sd, 0.7, 5.0 * 0.7 / std::sqrt(2.0 * n));

  const std::vector<double> off =
      simulator.touch(std::vector<Pose>(400, Pose{{500.0, 0.0}, 0.0}), {}).pressure;
  EXPECT_GE(*std::ranges::min_element(off), 0.0);
  // Half of the noise is negative; five standard errors of a proportion, 0.5 / sqrt(n).
  EXPECT_NEAR(static_cast<double>(std::ranges::count(off, 0.0)) / n, 0.5, 2.5 / std::sqrt(n));
}

TEST(Simulator, EveryPressHasAPositiveForce) {
  // Without the clamp, three forces in ten would be negative at this spread.
  const SensorModel model{.force_spread = 2.0, .gain_spread = 2.0, .noise_kpa = 0.0};
  Simulator simulator(plate(), model, digitacts_array(), 8);
  const Recording r = simulator.touch(std::vector<Pose>(200), {});
  EXPECT_GT(*std::min_element(r.pressure.begin(), r.pressure.end()), 0.0);
}

TEST(Simulator, HandlesAShapeFarLargerThanTheGridsLimit) {
  const Shape wide{.label = "wide",
                   .strokes = {},
                   .polygons = {{{0.0, -1e4}, {3e4, -1e4}, {3e4, 1e4}, {0.0, 1e4}}}};
  Simulator simulator(wide, {.force_spread = 0.0, .gain_spread = 0.0, .noise_kpa = 0.0},
                      {{0.0, 0.0}}, 1);
  const Recording r = simulator.touch({{{1.5e4, 0.0}, 0.0}, {{-200.0, 0.0}, 0.0}}, {});
  EXPECT_NEAR(r.pressure[0], 20.0, 1e-4);  // up to the tails of the point spread
  EXPECT_EQ(r.pressure[1], 0.0);
}

TEST(Simulator, RefusesWhatItCannotSimulateNamingTheField) {
  const auto expect_refused = [](const char* field, const SensorModel& model,
                                 const std::vector<glm::dvec2>& array = digitacts_array(),
                                 const Shape& shape = plate()) {
    expect_named(input_error([&] { Simulator(shape, model, array, 1); }), {field});
  };
  for (const double bad : {-1.0, nan, infinity}) {
    expect_refused("psf_mm", {.psf_mm = bad});
    expect_refused("element_mm", {.element_mm = bad});
    expect_refused("pressure_kpa", {.pressure_kpa = bad});
    expect_refused("force_spread", {.force_spread = bad});
    expect_refused("gain_spread", {.gain_spread = bad});
    expect_refused("noise_kpa", {.noise_kpa = bad});
  }
  expect_refused("element_mm", {.element_mm = 0.0});
  expect_refused("pressure_kpa", {.pressure_kpa = 0.0});
  expect_refused("array", {}, {});
  expect_refused("element 0", {}, {{0.0, nan}});

  Shape unbounded = plate();
  unbounded.polygons[0][2].x = nan;
  Shape too_wide = plate();
  too_wide.polygons[0][2].x = 1e300;
  const Shape empty{.label = "empty", .strokes = {}, .polygons = {}};
  const Shape thin{.label = "thin", .strokes = {{{{0.0, 0.0}, {0.0, 5.0}}, -4.0}}, .polygons = {}};
  for (const Shape& shape : {unbounded, too_wide, empty, thin}) {
    const std::string label = "'" + shape.label + "'";
    expect_refused(label.c_str(), {}, digitacts_array(), shape);
  }
}

TEST(Simulator, ThatWasMovedFromSaysSo) {
  Simulator first(make_shape("A"), {}, digitacts_array(), 1);
  Simulator second(std::move(first));
  EXPECT_EQ(second.touch({Pose{}}, {}).size(), 1U);
  EXPECT_THROW(first.touch({Pose{}}, {}), Error);  // NOLINT(bugprone-use-after-move): on purpose
}

}  // namespace palpate::simulator_test
