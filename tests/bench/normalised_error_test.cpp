#include "normalised_error.hpp"

#include <numbers>

#include <gtest/gtest.h>

#include "measurement.hpp"
#include "model/random.hpp"

namespace palpate::bench::normalised_error_test {

/// A bar of 12 x 4 mm about (3, 2) mm.
OccupancyGrid bar(int symmetry) {
  OccupancyGrid map;
  map.nx = 24;
  map.ny = 8;
  map.cell_mm = 0.5;
  map.origin_mm = {-2.5, 0.5};
  map.symmetry = symmetry;
  map.log_odds.assign(24 * 8, 1.0F);
  return map;
}

constexpr glm::dvec2 centroid_mm{3.25, 2.25};

/// Covariance A A' of errors A z, z standard normal.
struct Errors {
  double a[3][3] = {{0.4, 0.0, 0.0}, {0.2, 0.3, 0.0}, {-0.01, 0.02, 0.03}};

  std::array<double, 9> covariance() const {
    std::array<double, 9> c{};
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        for (int k = 0; k < 3; ++k) {
          c[3 * i + j] += a[i][k] * a[j][k];
        }
      }
    }
    return c;
  }
  Pose draw(Random& random) const {
    const double z[] = {random.normal(), random.normal(), random.normal()};
    double e[3] = {};
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) {
        e[i] += a[i][k] * z[k];
      }
    }
    return {{e[0], e[1]}, e[2]};
  }
};

/// The mean over many truths that lie about an estimate as its covariance says, each carried by the
/// symmetry to an equal pose that `turn_rad` gives.
template <typename Turn>
double mean_normalised_error(int symmetry, const Turn& turn_rad) {
  const Errors errors;
  const OccupancyGrid map = bar(symmetry);
  const RefinedPose refined{.T_object_robot = {{4.0, -7.0}, 3.1},
                            .covariance = errors.covariance()};
  Random random(11, Stream::touch_order);
  std::vector<double> values;
  for (int i = 0; i < 4000; ++i) {
    const Pose e = errors.draw(random);
    const Pose& estimate = refined.T_object_robot;
    const Pose near{estimate.translation_mm + e.translation_mm, estimate.theta_rad + e.theta_rad};
    const double turn = turn_rad(random);
    const Pose turned{centroid_mm - rotate(turn, centroid_mm), turn};
    values.push_back(normalised_error(map, refined, turned * near));
  }
  return mean(values);
}

// The mean of 4,000 values of a chi-square variable with three degrees of freedom is known to 0.04
// (one sigma), that of 3/2 times one with two to 0.05.
constexpr double tolerance = 0.2;

TEST(NormalisedError, IsThreeWhereCovariancesAreRight) {
  EXPECT_NEAR(mean_normalised_error(1, [](Random&) { return 0.0; }), 3.0, tolerance);
  EXPECT_NEAR(mean_normalised_error(1, [](Random&) { return 2.0 * std::numbers::pi; }), 3.0,
              tolerance);
}

TEST(NormalisedError, TakesTheNearestOfEqualPoses) {
  EXPECT_NEAR(mean_normalised_error(2, [](Random&) { return std::numbers::pi; }), 3.0, tolerance);
  EXPECT_GT(mean_normalised_error(1, [](Random&) { return std::numbers::pi; }), 1000.0);
}

TEST(NormalisedError, OfFullSymmetryLeavesOutTheAngle) {
  // The Jacobian is exact to first order in errors of 0.04 rad.
  EXPECT_NEAR(mean_normalised_error(0, [](Random& r) { return r.uniform(0.0, 6.0); }), 3.0,
              tolerance);
}

TEST(NormalisedError, GrowsWithTheSquareOfTheError) {
  const OccupancyGrid map = bar(1);
  RefinedPose refined{.T_object_robot = {}, .covariance = {4.0, 0, 0, 0, 1.0, 0, 0, 0, 0.01}};
  EXPECT_DOUBLE_EQ(normalised_error(map, refined, {{2.0, 0.0}, 0.0}), 1.0);
  EXPECT_DOUBLE_EQ(normalised_error(map, refined, {{4.0, 1.0}, 0.0}), 5.0);
  EXPECT_NEAR(normalised_error(map, refined, {{0.0, 0.0}, 0.2}), 4.0, 1e-12);
}

}  // namespace palpate::bench::normalised_error_test
