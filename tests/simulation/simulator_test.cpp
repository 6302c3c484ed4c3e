#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <set>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

#include "palpate/error.hpp"
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
  for (const double psf_mm : {0.0, 1.0}) {
    const SensorModel model{
        .psf_mm = psf_mm, .force_spread = 0.0, .gain_spread = 0.0, .noise_kpa = 0.0};
    Simulator simulator(wide, model, {{0.0, 0.0}}, 1);
    const Recording r = simulator.touch({{{1.5e4, 0.0}, 0.0}, {{-200.0, 0.0}, 0.0}}, {});
    EXPECT_NEAR(r.pressure[0], 20.0, 5e-5);  // up to the tails of the point spread
    EXPECT_EQ(r.pressure[1], 0.0);
  }
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

TEST(TouchPoses, TrainingGridHasTwelveAnglesAtSixteenPositions) {
  const std::vector<Pose> poses = training_grid();
  ASSERT_EQ(poses.size(), 192U);
  std::set<std::tuple<long, long, long>> distinct;
  glm::dvec2 mean{0.0};
  for (const Pose& pose : poses) {
    // Positions in half pitches from the centre are odd: -3, -1, 1, 3. Angles in twelfths.
    const glm::dvec2 position = pose.translation_mm / 3.4;
    const double angle = pose.theta_rad / (2.0 * std::numbers::pi / 12.0);
    // 1e-12: rounding only.
    EXPECT_NEAR(std::abs(std::abs(position.x) - 2.0), 1.0, 1e-12);
    EXPECT_NEAR(std::abs(std::abs(position.y) - 2.0), 1.0, 1e-12);
    EXPECT_NEAR(angle, std::round(angle), 1e-12);
    EXPECT_GE(angle, 0.0);
    EXPECT_LT(angle, 11.5);
    distinct.emplace(std::lround(position.x), std::lround(position.y), std::lround(angle));
    mean += pose.translation_mm;
  }
  EXPECT_EQ(distinct.size(), 192U);
  EXPECT_NEAR(mean.x, 0.0, 1e-9);
  EXPECT_NEAR(mean.y, 0.0, 1e-9);
}

/// Expects values spread uniformly over [lower, upper): inside it, in every eighth of it.
void expect_uniform(const std::vector<double>& values, double lower, double upper) {
  std::array<int, 8> counts{};
  for (const double value : values) {
    ASSERT_GE(value, lower);
    ASSERT_LT(value, upper);
    ++counts.at(static_cast<std::size_t>((value - lower) / (upper - lower) * 8.0));
  }
  const auto n = static_cast<double>(values.size());
  for (const int count : counts) {
    // Five standard errors of a binomial proportion of 1/8.
    EXPECT_NEAR(count, n / 8.0, 5.0 * std::sqrt(n * 7.0 / 64.0));
  }
}

/// Expects x and y uniform within half_mm of 0, and theta over the circle.
void expect_uniform(const std::vector<Pose>& poses, double half_mm) {
  std::array<std::vector<double>, 3> of;
  for (const Pose& pose : poses) {
    of[0].push_back(pose.translation_mm.x);
    of[1].push_back(pose.translation_mm.y);
    of[2].push_back(pose.theta_rad);
  }
  expect_uniform(of[0], -half_mm, half_mm);
  expect_uniform(of[1], -half_mm, half_mm);
  expect_uniform(of[2], 0.0, 2.0 * std::numbers::pi);
}

TEST(TouchPoses, RandomPosesAreUniformOverTheGridAndRepeatable) {
  const std::vector<Pose> poses = random_poses(20'000, 9);
  ASSERT_EQ(poses.size(), 20'000U);
  expect_uniform(poses, 10.2);
  // More poses of the same seed begin with the same ones.
  const std::vector<Pose> few = random_poses(3, 9);
  EXPECT_EQ(few[2].translation_mm, poses[2].translation_mm);
  EXPECT_NE(random_poses(1, 10)[0].translation_mm, poses[0].translation_mm);
  EXPECT_TRUE(random_poses(0, 9).empty());
  EXPECT_THROW(random_poses(-1, 9), Error);
}

TEST(TouchPoses, RandomObjectPosesAreUniformAndIndependentOfTheTouches) {
  constexpr int n = 2000;
  std::vector<Pose> poses;
  double correlation = 0.0;
  for (int seed = 0; seed < n; ++seed) {
    poses.push_back(random_object_pose(seed));
    // Both have a variance of one third of their squared half range.
    correlation += poses.back().translation_mm.x / 10.0 *
                   (random_poses(1, seed)[0].translation_mm.x / 10.2) * 3.0 / n;
  }
  expect_uniform(poses, 10.0);
  EXPECT_NEAR(correlation, 0.0, 5.0 / std::sqrt(n));  // five standard errors
}

}  // namespace palpate::simulator_test
