#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "palpate/error.hpp"
#include "palpate/simulation.hpp"
#include "support/limits.hpp"

namespace palpate::simulator_test {

/// A plate that every element of an array near its centre lies on entirely.
Shape plate() {
  return {.label = "plate",
          .strokes = {},
          .polygons = {{{-40.0, -40.0}, {40.0, -40.0}, {40.0, 40.0}, {-40.0, 40.0}}}};
}

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
    std::vector<double> both = simulator.touch(training_grid(), {}).pressure;
    const std::vector<double> second = simulator.touch(training_grid(), {}).pressure;
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
  Simulator still(make_shape("R"), {}, digitacts_array(), 5);
  Simulator moving(make_shape("R"), {}, digitacts_array(), 5);
  const Recording a = still.touch(poses, T_object_robot);
  const Recording b = moving.touch(moved, T_object_robot * inverse(T_moved_robot));
  ASSERT_EQ(a.pressure.size(), b.pressure.size());
  for (std::size_t i = 0; i < a.pressure.size(); ++i) {
    // Positions agree to 1e-12 mm, and the field rises by less than 20 kPa per mm.
    EXPECT_NEAR(a.pressure[i], b.pressure[i], 1e-9);
  }
}

TEST(Simulator, ForceVariesPerTouchAndGainPerElement) {
  constexpr int touches = 800;
  const SensorModel model{.force_spread = 0.15, .gain_spread = 0.05, .noise_kpa = 0.0};
  Simulator simulator(plate(), model, digitacts_array(), 21);
  const Recording r = simulator.touch(std::vector<Pose>(touches), {});
  double mean = 0.0;
  double square = 0.0;
  for (int i = 0; i < touches; ++i) {
    const Touch touch = r.touch(i);
    const double force = touch.pressure[0] / r.touch(0).pressure[0];
    // One force for all elements, so the pattern of gains is the same in every touch; 1e-9:
    // rounding.
    for (std::size_t e = 1; e < 36; ++e) {
      ASSERT_NEAR(touch.pressure[e], force * r.touch(0).pressure[e], 1e-9);
    }
    mean += force / touches;
    square += force * force / touches;
  }
  // Relative spread, five standard errors of it, 0.15 / sqrt(2 n).
  EXPECT_NEAR(std::sqrt(square / (mean * mean) - 1.0), 0.15, 5.0 * 0.15 / std::sqrt(2.0 * touches));

  double gain = 0.0;
  double gain_square = 0.0;
  for (const double pressure : r.touch(0).pressure) {
    gain += pressure / 36.0;
    gain_square += pressure * pressure / 36.0;
  }
  // Three standard errors of the spread of 36 gains, 0.05 / sqrt(72).
  EXPECT_NEAR(std::sqrt(gain_square / (gain * gain) - 1.0), 0.05, 3.0 * 0.05 / std::sqrt(72.0));
}

TEST(Simulator, NoiseIsAdditiveAndClampedAtZero) {
  const SensorModel model{.force_spread = 0.0, .gain_spread = 0.0, .noise_kpa = 0.7};
  Simulator simulator(plate(), model, digitacts_array(), 4);
  const std::size_t n = 400 * 36;
  const auto spread = [n](const std::vector<double>& x, double mean) {
    double sum = 0.0;
    for (const double value : x) {
      sum += (value - mean) * (value - mean);
    }
    return std::sqrt(sum / static_cast<double>(n));
  };
  // Five standard errors of a standard deviation, sigma / sqrt(2 n).
  const double tolerance = 5.0 * 0.7 / std::sqrt(2.0 * static_cast<double>(n));
  const Recording on = simulator.touch(std::vector<Pose>(400), {});
  EXPECT_NEAR(spread(on.pressure, 20.0), 0.7, tolerance);

  const Recording off = simulator.touch(std::vector<Pose>(400, Pose{{500.0, 0.0}, 0.0}), {});
  const auto zeros = std::count(off.pressure.begin(), off.pressure.end(), 0.0);
  EXPECT_GE(*std::min_element(off.pressure.begin(), off.pressure.end()), 0.0);
  // Half of the noise is negative; five standard errors of a proportion, 0.5 / sqrt(n).
  EXPECT_NEAR(static_cast<double>(zeros) / static_cast<double>(n), 0.5,
              2.5 / std::sqrt(static_cast<double>(n)));
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
  const auto expect_refused = [](const Shape& shape, const SensorModel& model,
                                 std::vector<glm::dvec2> elements, const char* field) {
    try {
      Simulator(shape, model, std::move(elements), 1);
      ADD_FAILURE() << field;
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), Fault::input);
      EXPECT_THAT(error.what(), testing::HasSubstr(field));
    }
  };
  const std::vector<glm::dvec2> array = digitacts_array();
  for (const double bad : {-1.0, nan, std::numeric_limits<double>::infinity()}) {
    expect_refused(plate(), {.psf_mm = bad}, array, "psf_mm");
    expect_refused(plate(), {.element_mm = bad}, array, "element_mm");
    expect_refused(plate(), {.pressure_kpa = bad}, array, "pressure_kpa");
    expect_refused(plate(), {.force_spread = bad}, array, "force_spread");
    expect_refused(plate(), {.gain_spread = bad}, array, "gain_spread");
    expect_refused(plate(), {.noise_kpa = bad}, array, "noise_kpa");
  }
  expect_refused(plate(), {.element_mm = 0.0}, array, "element_mm");
  expect_refused(plate(), {.pressure_kpa = 0.0}, array, "pressure_kpa");
  expect_refused(plate(), {}, {}, "array");
  expect_refused(plate(), {}, {{0.0, nan}}, "element 0");

  expect_refused({.label = "empty", .strokes = {}, .polygons = {}}, {}, array, "'empty'");
  Shape shape = plate();
  shape.polygons[0][2].x = nan;
  expect_refused(shape, {}, array, "'plate'");
  shape.polygons[0][2].x = 1e300;
  expect_refused(shape, {}, array, "'plate'");
  shape = {.label = "thin", .strokes = {{{{0.0, 0.0}, {0.0, 5.0}}, -4.0}}, .polygons = {}};
  expect_refused(shape, {}, array, "'thin'");
}

TEST(Simulator, ThatWasMovedFromSaysSo) {
  Simulator first(make_shape("A"), {}, digitacts_array(), 1);
  Simulator second(std::move(first));
  EXPECT_EQ(second.touch({Pose{}}, {}).size(), 1U);
  EXPECT_THROW(first.touch({Pose{}}, {}), Error);  // NOLINT(bugprone-use-after-move): on purpose
}

}  // namespace palpate::simulator_test
