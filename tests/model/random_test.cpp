#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "model/displacement_points.hpp"
#include "model/random.hpp"

namespace palpate::random_test {

constexpr int draws = 400'000;

/// Expects that a share of `probability(z)` of the draws is below each z.
void expect_distributed(const std::function<double()>& draw, const std::vector<double>& zs,
                        const std::function<double(double)>& probability) {
  std::vector<double> x(draws);
  std::ranges::generate(x, draw);
  for (const double z : zs) {
    const double below =
        static_cast<double>(std::ranges::count_if(x, [z](double v) { return v < z; }));
    const double p = probability(z);
    // Five standard errors of a binomial proportion.
    EXPECT_NEAR(below / draws, p, 5.0 * std::sqrt(p * (1.0 - p) / draws)) << "z = " << z;
  }
}

TEST(Random, DrawsAreUniformInTheHalfOpenUnitIntervalAndStandardNormalWithTheirTails) {
  Random random(1, Stream::sensor);
  expect_distributed([&] { return random.uniform(); }, {0.0, 0.01, 0.2, 0.5, 0.8, 0.99, 1.0},
                     [](double z) { return z; });
  expect_distributed([&] { return random.normal(); }, {-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0},
                     [](double z) { return std::erfc(-z / std::sqrt(2.0)) / 2.0; });
}

TEST(Random, EngineIsTheSameOnEveryStandardLibrary) {
  // Computed apart from this program, from the definitions of seed_seq and MT19937-64.
  Random random(42, Stream::touch_poses);
  EXPECT_EQ(random.uniform(), 0x1.95707a74cb2e0p-5);
  EXPECT_EQ(random.uniform(), 0x1.ee21ab0dd47b4p-2);
}

TEST(Random, StreamsAndSeedsDiffer) {
  const double first = Random(5, Stream::sensor).uniform();
  EXPECT_EQ(Random(5, Stream::sensor).uniform(), first);
  EXPECT_NE(Random(5, Stream::touch_poses).uniform(), first);
  EXPECT_NE(Random(5, Stream::object_pose).uniform(), first);
  EXPECT_NE(Random(6, Stream::sensor).uniform(), first);
  // Seeds that differ in the upper half only.
  EXPECT_NE(Random(5 + (std::uint64_t{1} << 32), Stream::sensor).uniform(), first);
}

TEST(NormalQuantile, InvertsTheDistributionFunction) {
  for (const double x : {-6.0, -2.5, -1.0, -0.1, 0.0, 0.3, 1.7, 4.0}) {
    const double probability = 0.5 * std::erfc(-x / std::sqrt(2.0));
    EXPECT_NEAR(normal_quantile(probability), x, 1e-8);
  }
}

TEST(DisplacementPoints, HaveTheMomentsOfTheDistribution) {
  const DisplacementSd sd{.mm = 1.5, .rad = 0.05};
  glm::dvec3 mean{0.0};
  glm::dvec3 squares{0.0};
  double xy = 0.0;
  for (const Pose& point : displacement_points(sd, 256)) {
    const glm::dvec3 p{point.translation_mm / sd.mm, point.theta_rad / sd.rad};
    mean += p / 256.0;
    squares += p * p / 256.0;
    xy += p.x * p.y / 256.0;
  }
  // Independent random points would be off by 6 and 9 %.
  EXPECT_NEAR(mean.x, 0.0, 0.02);
  EXPECT_NEAR(xy, 0.0, 0.08);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(squares[axis], 1.0, 0.03);
  }
}

TEST(DisplacementPoints, LeaveAloneWhatIsNotDisplaced) {
  const std::vector<Pose> points = displacement_points({}, 256);
  ASSERT_EQ(points.size(), 1U);
  EXPECT_EQ(points.front().translation_mm, glm::dvec2(0.0));
  EXPECT_EQ(points.front().theta_rad, 0.0);
}

TEST(Slipped, TurnsTheObjectAboutItsCentroidAndMovesIt) {
  const Pose T_object_robot{{4.0, -7.0}, 0.8};
  const glm::dvec2 centroid_mm{12.0, 5.0};
  const Pose after = slipped(T_object_robot, {{0.5, -0.25}, 0.3}, centroid_mm);
  const glm::dvec2 moved = after * (inverse(T_object_robot) * centroid_mm) - centroid_mm;
  EXPECT_NEAR(moved.x, 0.5, 1e-12) << "rounding of some 10 mm in float64";
  EXPECT_NEAR(moved.y, -0.25, 1e-12);
  EXPECT_NEAR(after.theta_rad, 1.1, 1e-12);
}

}  // namespace palpate::random_test
