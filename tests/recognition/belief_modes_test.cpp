#include "recognition/belief_modes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "model/body_spread.hpp"

namespace palpate::belief_modes_test {

constexpr double circle_rad = 2.0 * std::numbers::pi;

/// A Gaussian over (x, y, theta) of the lattice, whose axes are independent.
struct Hill {
  double share;
  glm::dvec3 centre;
  glm::dvec3 sd;
};

/// The bins of a mixture of hills, times exp(ripple) of either sign from bin to bin.
std::vector<BinShare> belief(const PoseLattice& lattice, const std::vector<Hill>& hills,
                             double ripple_nats = 0.0) {
  std::vector<BinShare> bins;
  double all = 0.0;
  for (std::int64_t bin = 0; bin < lattice.bins(); ++bin) {
    const auto in_plane = static_cast<int>(bin % lattice.plane());
    const glm::dvec3 at(lattice.x_mm.centre(in_plane % lattice.x_mm.count),
                        lattice.y_mm.centre(in_plane / lattice.x_mm.count),
                        lattice.theta_rad.centre(static_cast<int>(bin / lattice.plane())));
    double p = 0.0;
    for (const Hill& hill : hills) {
      glm::dvec3 d = at - hill.centre;
      d.z = wrap_angle(d.z, circle_rad);
      d /= hill.sd;
      p += hill.share / (hill.sd.x * hill.sd.y * hill.sd.z) * std::exp(-0.5 * glm::dot(d, d));
    }
    p *= std::exp(ripple_nats * (bin % 3 - 1.0));
    bins.push_back({bin, p});
    all += p;
  }
  for (BinShare& bin : bins) {
    bin.share /= all;
  }
  return bins;
}

/// A body of 9 mm about its centroid, away from the frame's origin; the pivot lies away, too.
BinnedObject letter(int symmetry = 1) {
  return {.lattice = {{-10.0, 10.0, 40}, {-10.0, 10.0, 40}, {0.0, circle_rad, 72}, {4.0, -3.0}},
          .body = {.centroid_mm = {2.0, 1.0}, .inertia_mm2 = 81.0},
          .symmetry = symmetry};
}

/// The most probable mode, which there is.
BeliefMode first_mode(const BinnedObject& of, std::span<const BinShare> bins) {
  return std::ranges::max(find_modes(of, bins).modes, {}, &BeliefMode::probability);
}

TEST(BeliefModes, OfTwoHillsHaveTheSharesMeansAndCovariancesOfTheirBins) {
  const BinnedObject of = letter();
  const std::vector<Hill> hills{{0.7, {-4.0, 3.0, 0.8}, {0.7, 0.6, 0.1}},
                                {0.3, {5.0, -2.0, 3.9}, {0.8, 0.9, 0.15}}};
  const std::vector<BinShare> bins = belief(of.lattice, hills);
  const auto [modes, mode_of] = find_modes(of, bins);
  ASSERT_EQ(modes.size(), 2U);
  ASSERT_EQ(mode_of.size(), bins.size());
  EXPECT_EQ(*std::ranges::max_element(mode_of), 2U) << "some are of no mode";
  for (const std::size_t i : {0U, 1U}) {
    const auto& [share, at, sd] = hills[modes[i].probability > 0.5 ? 0 : 1];
    // Bins more than 7 nats below the peak, 0.3 % of a Gaussian, are of no mode.
    EXPECT_NEAR(modes[i].probability, share, 0.004 * share);
    EXPECT_LT(pose_error_mm(of.body, 1, modes[i].best, of.lattice.T_object_robot(at.x, at.y, at.z)),
              0.6);  // half of a bin's diagonal
    double all = 0.0;
    glm::dvec3 sum{0.0};
    glm::dmat3 squares{0.0};
    for (std::size_t k = 0; k < bins.size(); ++k) {
      if (mode_of[k] == i) {
        const Pose T_robot_object = inverse(of.lattice.T_object_robot(bins[k].bin));
        const glm::dvec3 pose(T_robot_object.translation_mm, T_robot_object.theta_rad);
        all += bins[k].share;
        sum += bins[k].share * pose;
        squares += bins[k].share * glm::outerProduct(pose, pose);
      }
    }
    EXPECT_NEAR(modes[i].probability, all, 1e-12);
    const glm::dvec3 expected = sum / all;
    const glm::dmat3 moment = squares / all - glm::outerProduct(expected, expected);
    const Pose& mean = modes[i].pose.T_robot_object;
    EXPECT_NEAR(mean.translation_mm.x, expected.x, 1e-9);
    EXPECT_NEAR(mean.translation_mm.y, expected.y, 1e-9);
    EXPECT_NEAR(wrap_angle(mean.theta_rad - expected.z, circle_rad), 0.0, 1e-9);
    const std::array<double, 9>& covariance = modes[i].pose.covariance;
    for (int k = 0; k < 9; ++k) {
      // Bins of 0.5 mm and 5 degrees add their own spread, with the lever of 10 mm.
      EXPECT_NEAR(covariance[k], moment[k % 3][k / 3], 0.06 * std::max(1.0, moment[0][0]));
    }
    EXPECT_NEAR(std::sqrt(covariance[8]), sd.z, 0.01);
    EXPECT_EQ(covariance[1], covariance[3]);
    EXPECT_EQ(covariance[5], covariance[7]);
  }
}

TEST(BeliefModes, CountARippledPeakOnceAndAtTheCirclesEnd) {
  const BinnedObject of = letter();
  const auto modes =
      find_modes(of, belief(of.lattice, {{1.0, {1.0, 1.0, 0.02}, {1.5, 1.2, 0.15}}}, 0.4)).modes;
  ASSERT_EQ(modes.size(), 1U);
  EXPECT_GT(modes.front().probability, 0.99);
  EXPECT_NEAR(std::sqrt(modes.front().pose.covariance[8]), 0.15, 0.01);
}

TEST(BeliefModes, LeaveAPlainOutThatLiesFarBelowThePeak) {
  const BinnedObject of = letter();
  std::vector<BinShare> bins = belief(of.lattice, {{1.0, {0.0, 0.0, 3.0}, {0.5, 0.5, 0.1}}});
  for (BinShare& bin : bins) {  // half of the belief, a ten-thousandth of the peak's height
    bin.share = 0.5 * bin.share + 0.5 / static_cast<double>(of.lattice.bins());
  }
  const BeliefMode mode = first_mode(of, bins);
  EXPECT_NEAR(mode.probability, 0.5, 0.01);
  EXPECT_LT(std::sqrt(mode.pose.covariance[0]), 1.5);
}

TEST(BeliefModes, FoldEqualTurnsOntoOne) {
  const BinnedObject of = letter(2);
  const glm::dvec2 c = of.body.centroid_mm;
  const glm::dvec3 one(4.0, 2.0, 0.4);
  // Turned by half a turn about the centroid in the object frame.
  const glm::dvec3 other(2.0 * c.x - one.x, 2.0 * c.y - one.y, one.z + std::numbers::pi);
  const glm::dvec3 sd(0.6, 0.6, 0.1);
  const std::vector<BinShare> bins = belief(of.lattice, {{0.5, one, sd}, {0.5, other, sd}});
  EXPECT_EQ(find_modes(letter(1), bins).modes.size(), 2U);
  ASSERT_EQ(find_modes(of, bins).modes.size(), 1U);
  const BeliefMode mode = first_mode(of, bins);
  EXPECT_GT(mode.probability, 0.99);
  const Pose at = of.lattice.T_object_robot(one.x, one.y, one.z);
  const Pose& mean = mode.pose.T_robot_object;
  EXPECT_NEAR(mean.theta_rad, -at.theta_rad, 0.01);
  // The mean over a turn of 0.1 rad lies on the chord of the arc.
  EXPECT_LT(glm::distance(mean.translation_mm, inverse(at).translation_mm), 0.1);
  EXPECT_NEAR(std::sqrt(mode.pose.covariance[8]), 0.1, 0.01);
  EXPECT_GT(share_within(parts_away(of, bins, at), 5.0), 0.99);
  EXPECT_NEAR(share_within(parts_away(letter(1), bins, at), 5.0), 0.5, 0.01);
}

TEST(BeliefModes, OfADiscAreOnePlaceWhateverTheTurn) {
  const BinnedObject of = letter(0);
  std::vector<Hill> ring;
  for (double theta_rad = 0.0; theta_rad < circle_rad; theta_rad += 0.2) {
    // The body's centroid stays at (1, 2) in the robot frame.
    const glm::dvec2 xy =
        of.body.centroid_mm - rotate(theta_rad, glm::dvec2(1.0, 2.0) - of.lattice.pivot_mm);
    ring.push_back({1.0, {xy, theta_rad}, {0.5, 0.5, 0.1}});
  }
  const BeliefMode mode = first_mode(of, belief(of.lattice, ring, 0.3));
  EXPECT_GT(mode.probability, 0.98);
  const auto& [T_robot_object, covariance] = mode.pose;
  EXPECT_NEAR(T_robot_object.theta_rad, 0.0, 1e-9);
  EXPECT_LT(glm::distance(T_robot_object * of.body.centroid_mm, {1.0, 2.0}), 0.05);
  EXPECT_LT(std::sqrt(covariance[0]), 0.8);
}

TEST(PartsAway, AreAsFarAsThePoseErrorSays) {
  const BinnedObject of = letter(2);
  const Pose pose = of.lattice.T_object_robot(3.0, -1.0, 5.0);
  for (const std::int64_t bin : {0, 1234, 50'000, 115'199}) {
    const auto parts = parts_away(of, std::vector<BinShare>{{bin, 0.5}}, pose);
    ASSERT_EQ(parts.size(), 1U);
    EXPECT_NEAR(parts.front().mm, pose_error_mm(of.body, 2, pose, of.lattice.T_object_robot(bin)),
                1e-9);
    EXPECT_EQ(distance_holding(parts, 0.4999), parts.front().mm);
    EXPECT_FALSE(distance_holding(parts, 0.6));
  }
}

TEST(PartsAway, NearThePoseLieAsItsCovarianceSaysWhateverTheBin) {
  const BinnedObject of = letter();
  const RefinedPose refined{of.lattice.T_object_robot(3.0, -1.0, 2.0),
                            {0.04, 0.0, 0.0, 0.0, 0.04, 0.0, 0.0, 0.0, 1e-8}};
  const auto parts = spread_between_bins(of, {{0.4, 0.9}, {7.0, 0.1}}, refined);
  EXPECT_NEAR(share_within(parts, 1e3), 1.0, 1e-9);
  EXPECT_NEAR(share_within(parts, 2.0), 0.9, 1e-9) << "what is far stays";
  // Two independent axes of 0.2 mm: Rayleigh.
  for (const double share : {0.5, 0.8}) {
    EXPECT_NEAR(distance_holding(parts, 0.9 * share).value(),
                0.2 * std::sqrt(-2.0 * std::log(1.0 - share)), 0.01);
  }
}

TEST(PartsAway, LieAsNearWhereverTheRobotsOriginIs) {
  const BinnedObject of = letter();
  const Pose near = of.lattice.T_object_robot(3.0, -1.0, 2.0);
  const std::array<double, 9> covariance{0.04, 0.0, 0.0, 0.0, 0.04, 0.0, 0.0, 0.0, 1e-3};
  const glm::dvec2 away_mm(800.0, -600.0);
  glm::dmat3 jacobian{1.0};  // by columns
  jacobian[2] = {-rotate(near.theta_rad + std::numbers::pi / 2.0, away_mm), 1.0};
  const RefinedPose far{near * Pose{-away_mm, 0.0},
                        carried_over(glm::make_mat3(covariance.data()), jacobian)};
  const auto held_mm = [&](const RefinedPose& refined) {
    return distance_holding(spread_between_bins(of, {{0.4, 1.0}}, refined), 0.6827).value();
  };
  EXPECT_NEAR(held_mm(far), held_mm({near, covariance}), 1e-6);
  // A turn moves the body's middle about the robot's origin, and the body about its middle.
  const double lever_mm =
      std::hypot(glm::distance(near.translation_mm, of.body.centroid_mm), spin_mm(of.body));
  EXPECT_NEAR(held_mm({near, {0, 0, 0, 0, 0, 0, 0, 0, 1e-4}}), 0.01 * lever_mm, 5e-4 * lever_mm);
}

}  // namespace palpate::belief_modes_test
