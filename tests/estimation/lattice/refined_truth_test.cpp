// The refined pose of beliefs whose peak and covariance are known: whatever way leads there.

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "estimation/lattice/refinement.hpp"
#include "palpate/pose.hpp"
#include "support/synthetic.hpp"

namespace palpate::refined_truth_test {

constexpr double spin_mm = 8.0;  // a radian moves the object by so much

using LogBelief = std::function<double(const glm::dvec3&)>;

/// Refines around the best bin of a belief over x, y and theta, which is evaluated where it is
/// asked.
RefinedPose refined(const PoseLattice& lattice, const glm::dvec2& centroid_mm,
                    const LogBelief& log_belief) {
  const auto at_bin = [&](std::int64_t bin) {
    const Pose pose = lattice.T_object_robot(bin);
    return log_belief({pose * lattice.pivot_mm, pose.theta_rad});
  };
  const auto in_boxes = [&](std::span<const BinBox> boxes) {
    std::vector<double> values;
    for (const BinBox& box : boxes) {
      for (std::int64_t i = 0; i < box.bins(); ++i) {
        values.push_back(at_bin(box.bin(i, lattice)));
      }
    }
    return values;
  };
  std::int64_t best = 0;
  double most = at_bin(best);
  for (std::int64_t bin = 1; bin < lattice.bins(); ++bin) {
    if (const double here = at_bin(bin); here > most) {
      best = bin;
      most = here;
    }
  }
  return refine(in_boxes, lattice, {.centroid_mm = centroid_mm, .inertia_mm2 = spin_mm * spin_mm},
                {.bin = best});
}

/// Bins of 0.25 mm, and of as much for the object in theta.
PoseLattice lattice_from(double theta_rad) {
  return {.x_mm = {-4.0, 4.0, 32},
          .y_mm = {-4.0, 4.0, 32},
          .theta_rad = {theta_rad, theta_rad + two_pi, 201},
          .pivot_mm = {}};
}

TEST(RefinedPose, OfAnExactQuadraticIsItsPeakAndItsCovarianceTheInverse) {
  Uniform random(191);
  for (int trial = 0; trial < 6; ++trial) {
    const glm::dvec3 peak(random(-0.5, 0.5), random(-0.5, 0.5), random(0.0, two_pi));
    // Standard deviations of 0.2 to 0.4 mm along axes that are turned against the lattice's.
    glm::dmat3 root(1.0);
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) {
        root[i][k] = i == k ? random(0.25, 0.4) : random(-0.1, 0.1);
      }
    }
    const glm::dmat3 covariance_mm2 = root * glm::transpose(root);
    const glm::dmat3 precision = glm::inverse(covariance_mm2);
    for (const double from_rad : {0.0, -2.5}) {
      const PoseLattice lattice = lattice_from(from_rad);
      const RefinedPose pose = refined(lattice, glm::dvec2(peak), [&](const glm::dvec3& at) {
        const glm::dvec3 d(glm::dvec2(at) - glm::dvec2(peak),
                           spin_mm * wrap_angle(at.z - peak.z, two_pi));
        return -0.5 * glm::dot(d, precision * d);
      });
      // A turn about the mean also swings the centroid, by the mean's error times the turn.
      EXPECT_NEAR(pose.T_object_robot.translation_mm.x, peak.x, 1e-3);
      EXPECT_NEAR(pose.T_object_robot.translation_mm.y, peak.y, 1e-3);
      EXPECT_NEAR(spin_mm * wrap_angle(pose.T_object_robot.theta_rad - peak.z, two_pi), 0.0, 1e-3);
      const glm::dvec3 scale(1.0, 1.0, spin_mm);
      for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) {
          EXPECT_NEAR(pose.covariance[3 * i + k] * scale[i] * scale[k], covariance_mm2[i][k], 1e-3)
              << i << ", " << k;
        }
      }
    }
  }
}

TEST(RefinedPose, OfAFullCircleLiesOnItWhereverItBegins) {
  const double step = lattice_from(0.0).theta_rad.step();
  for (int shift = -16; shift <= 16; ++shift) {
    // A peak about the seam, steeper to one side, so that mean and peak may lie on two sides of it.
    const double peak = 0.25 * shift * step;
    for (const double side : {-1.0, 1.0}) {
      const auto log_belief = [&](const glm::dvec3& at) {
        const double turn_mm = spin_mm * wrap_angle(at.z - peak, two_pi);
        const double sd_mm = side * turn_mm > 0.0 ? 0.15 : 0.6;
        return -0.5 * (at.x * at.x + at.y * at.y) / 0.16 -
               0.5 * turn_mm * turn_mm / (sd_mm * sd_mm);
      };
      // Both lattices have the same bins. One has its seam at the peak, the other opposite.
      PoseLattice lattice = lattice_from(0.0);
      lattice.x_mm = lattice.y_mm = {-1.0, 1.0, 8};
      PoseLattice turned = lattice;
      turned.theta_rad.lower -= 100 * step;
      turned.theta_rad.upper -= 100 * step;
      const double theta_rad = refined(lattice, {}, log_belief).T_object_robot.theta_rad;
      const double other_rad = refined(turned, {}, log_belief).T_object_robot.theta_rad;
      EXPECT_GE(theta_rad, lattice.theta_rad.lower) << shift;
      EXPECT_LT(theta_rad, lattice.theta_rad.upper) << shift;
      EXPECT_GE(other_rad, turned.theta_rad.lower) << shift;
      EXPECT_LT(other_rad, turned.theta_rad.upper) << shift;
      EXPECT_NEAR(wrap_angle(theta_rad - other_rad, two_pi), 0.0, 1e-6) << shift;
      EXPECT_LT(spin_mm * std::abs(wrap_angle(theta_rad - peak, two_pi)), 1.0) << shift;
    }
  }
}

}  // namespace palpate::refined_truth_test
