#include "recognition/belief_modes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "estimation/lattice/refinement.hpp"
#include "recognition/recognition_record.hpp"
#include "shapes.hpp"
#include "synthetic.hpp"
#include "unknown_of.hpp"

namespace palpate::belief_modes_test {

constexpr double circle_rad = 2.0 * std::numbers::pi;

/// A Gaussian over (x, y, theta) of the lattice, whose axes are independent.
struct Hill {
  double share;
  glm::dvec3 centre;
  glm::dvec3 sd;
};

/// The bins of a mixture of hills, times exp(ripple) of either sign from bin to bin.
std::vector<BinShare> belief(const PoseLattice& lattice, std::span<const Hill> hills,
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

std::vector<BeliefMode> sorted_modes(const BinnedObject& of, std::span<const BinShare> bins) {
  std::vector<BeliefMode> modes = find_modes(of, bins).modes;
  std::ranges::sort(modes, std::greater<>(), &BeliefMode::probability);
  return modes;
}

TEST(BeliefModes, OfTwoHillsHaveTheirSharesMeansAndCovariances) {
  const BinnedObject of = letter();
  const std::vector<Hill> hills{{0.7, {-4.0, 3.0, 0.8}, {0.7, 0.6, 0.1}},
                                {0.3, {5.0, -2.0, 3.9}, {0.8, 0.9, 0.15}}};
  const std::vector<BeliefMode> modes = sorted_modes(of, belief(of.lattice, hills));
  ASSERT_EQ(modes.size(), 2U);
  for (const std::size_t i : {0U, 1U}) {
    // Bins more than 7 nats below the peak, 0.3 % of a Gaussian, are of no mode.
    EXPECT_NEAR(modes[i].probability, hills[i].share, 0.004 * hills[i].share);
    const glm::dvec3& at = hills[i].centre;
    EXPECT_LT(pose_error_mm(of.body, 1, modes[i].best, of.lattice.T_object_robot(at.x, at.y, at.z)),
              0.6);  // half of a bin's diagonal
    // The moments of T_robot_object by quadrature over the hill.
    double all = 0.0;
    glm::dvec3 sum{0.0};
    glm::dmat3 squares{0.0};
    for (double x = -3.5; x <= 3.5; x += 0.25) {
      for (double y = -3.5; y <= 3.5; y += 0.25) {
        for (double z = -3.5; z <= 3.5; z += 0.25) {
          const double p = std::exp(-0.5 * (x * x + y * y + z * z));
          const glm::dvec3 place = at + hills[i].sd * glm::dvec3(x, y, z);
          const Pose T_robot_object = inverse(of.lattice.T_object_robot(place.x, place.y, place.z));
          const glm::dvec3 pose(T_robot_object.translation_mm, T_robot_object.theta_rad);
          all += p;
          sum += p * pose;
          squares += p * glm::outerProduct(pose, pose);
        }
      }
    }
    const glm::dvec3 expected = sum / all;
    const glm::dmat3 moment = squares / all - glm::outerProduct(expected, expected);
    const Pose& mean = modes[i].pose.T_robot_object;
    EXPECT_NEAR(mean.translation_mm.x, expected.x, 0.01);
    EXPECT_NEAR(mean.translation_mm.y, expected.y, 0.01);
    EXPECT_NEAR(wrap_angle(mean.theta_rad - expected.z, circle_rad), 0.0, 1e-3);
    const std::array<double, 9>& covariance = modes[i].pose.covariance;
    for (int k = 0; k < 9; ++k) {
      // Bins of 0.5 mm and 5 degrees add their own spread, at most 0.05 mm^2 with the lever of
      // 10 mm; the foot takes away a few hundredths.
      EXPECT_NEAR(covariance[k], moment[k % 3][k / 3], 0.06 * std::max(1.0, moment[0][0]));
    }
    EXPECT_NEAR(std::sqrt(covariance[8]), hills[i].sd.z, 0.01);
    EXPECT_EQ(covariance[1], covariance[3]);
    EXPECT_EQ(covariance[5], covariance[7]);
  }
}

TEST(BeliefModes, AreSumsOverTheBinsThatAreTheirs) {
  const BinnedObject of = letter();
  const std::vector<BinShare> bins =
      belief(of.lattice, std::vector<Hill>{{0.7, {-4.0, 3.0, 0.8}, {0.7, 0.6, 0.1}},
                                           {0.3, {5.0, -2.0, 3.9}, {0.8, 0.9, 0.15}}});
  const auto [modes, mode_of] = find_modes(of, bins);
  ASSERT_EQ(mode_of.size(), bins.size());
  std::vector<double> sums(modes.size() + 1);  // the last is of bins of no mode
  for (std::size_t i = 0; i < bins.size(); ++i) {
    sums.at(mode_of[i]) += bins[i].share;
  }
  for (std::size_t i = 0; i < modes.size(); ++i) {
    EXPECT_NEAR(modes[i].probability, sums[i], 1e-12);
  }
  EXPECT_GT(sums.back(), 0.0);
}

TEST(BeliefModes, CountARippledPeakOnceAndAtTheCirclesEnd) {
  const BinnedObject of = letter();
  const std::vector<Hill> hill{{1.0, {1.0, 1.0, 0.02}, {1.5, 1.2, 0.15}}};
  const std::vector<BeliefMode> modes = sorted_modes(of, belief(of.lattice, hill, 0.4));
  ASSERT_EQ(modes.size(), 1U);
  EXPECT_GT(modes.front().probability, 0.99);
  EXPECT_NEAR(std::sqrt(modes.front().pose.covariance[8]), 0.15, 0.01);
}

TEST(BeliefModes, LeaveAPlainOutThatLiesFarBelowThePeak) {
  const BinnedObject of = letter();
  std::vector<BinShare> bins =
      belief(of.lattice, std::vector<Hill>{{1.0, {0.0, 0.0, 3.0}, {0.5, 0.5, 0.1}}});
  for (BinShare& bin : bins) {  // half of the belief, a ten-thousandth of the peak's height
    bin.share = 0.5 * bin.share + 0.5 / static_cast<double>(of.lattice.bins());
  }
  const std::vector<BeliefMode> modes = sorted_modes(of, bins);
  ASSERT_FALSE(modes.empty());
  EXPECT_NEAR(modes.front().probability, 0.5, 0.01);
  EXPECT_LT(std::sqrt(modes.front().pose.covariance[0]), 1.5);
}

TEST(BeliefModes, FoldEqualTurnsOntoOne) {
  const BinnedObject of = letter(2);
  const glm::dvec2 c = of.body.centroid_mm;
  const glm::dvec3 one(4.0, 2.0, 0.4);
  // Turned by half a turn about the centroid in the object frame.
  const glm::dvec3 other(2.0 * c.x - one.x, 2.0 * c.y - one.y, one.z + std::numbers::pi);
  const glm::dvec3 sd(0.6, 0.6, 0.1);
  const std::vector<BinShare> bins =
      belief(of.lattice, std::vector<Hill>{{0.5, one, sd}, {0.5, other, sd}});
  EXPECT_EQ(find_modes(letter(1), bins).modes.size(), 2U);
  const std::vector<BeliefMode> modes = find_modes(of, bins).modes;
  ASSERT_EQ(modes.size(), 1U);
  EXPECT_GT(modes.front().probability, 0.99);
  const Pose at = inverse(of.lattice.T_object_robot(one.x, one.y, one.z));
  const Pose& mean = modes.front().pose.T_robot_object;
  EXPECT_NEAR(mean.theta_rad, at.theta_rad, 0.01);
  // The mean over a turn of 0.1 rad lies on the chord of the arc.
  EXPECT_LT(glm::distance(mean.translation_mm, at.translation_mm), 0.1);
  EXPECT_NEAR(std::sqrt(modes.front().pose.covariance[8]), 0.1, 0.01);
  const auto parts = parts_away(of, bins, of.lattice.T_object_robot(one.x, one.y, one.z));
  EXPECT_GT(share_within(parts, 5.0), 0.99);
  EXPECT_NEAR(share_within(parts_away(letter(1), bins, inverse(at)), 5.0), 0.5, 0.01);
}

TEST(BeliefModes, OfADiscAreOnePlaceWhateverTheTurn) {
  const BinnedObject of = letter(0);
  std::vector<Hill> ring;
  for (double theta_rad = 0.0; theta_rad < circle_rad; theta_rad += 0.1) {
    // The body's centroid stays at (1, 2) in the robot frame.
    const glm::dvec2 xy =
        of.body.centroid_mm - rotate(theta_rad, glm::dvec2(1.0, 2.0) - of.lattice.pivot_mm);
    ring.push_back({1.0, {xy, theta_rad}, {0.5, 0.5, 0.1}});
  }
  const std::vector<BeliefMode> modes = sorted_modes(of, belief(of.lattice, ring, 0.3));
  ASSERT_FALSE(modes.empty());
  EXPECT_GT(modes.front().probability, 0.98);
  const auto& [T_robot_object, covariance] = modes.front().pose;
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

class Places : public testing::Test {
 protected:
  /// The last step of a letter's first touches.
  RecognitionStep step_by(std::size_t filter, std::size_t touches) {
    const RecognitionTask task(shapes(), every_filter()[filter]);
    Recogniser recogniser(device, task);
    return take_step(recogniser, task, all_touches(recording, touches),
                     unknown_of(recording).truth);
  }
  static std::vector<Touch> all_touches(const Recording& recording, std::size_t touches) {
    return recording.touches(0, touches);
  }

  Device device = Device::open();
  Recording recording = touched_letter(5);
};

TEST_F(Places, AreTheMassesOfTheFullHistogram) {
  const auto options = std::get<HistogramOptions>(every_filter()[0]);
  const RecognitionTask task(shapes(), options);
  for (const std::size_t touches : {1U, 3U, 6U}) {
    Recogniser recogniser(device, task);
    const RecognitionStep step = take_step(recogniser, task, all_touches(recording, touches), {});
    std::vector<double> mass(task.hypotheses.size());
    double near = 0.0;
    for (std::size_t object = 0; object < mass.size(); ++object) {
      const std::vector<double> logs =
          recogniser.histogram()->log_likelihood(static_cast<int>(object));
      const double top = *std::ranges::max_element(logs);
      double sum = 0.0;
      for (const double log : logs) {
        sum += std::exp(log - top);
      }
      const auto likely =
          recogniser.histogram()->likely_bins(std::vector<int>{static_cast<int>(object)}, 1e-6);
      for (const auto& [bin, share] : likely.front()) {
        mass[object] += share;
        EXPECT_NEAR(share, std::exp(logs[static_cast<std::size_t>(bin)] - top) / sum, 1e-6);
      }
      EXPECT_NEAR(mass[object], 1.0, 0.01) << "6,400 bins below 1e-6 each";
      // Bins within the neighbourhood, counted by their centres.
      if (static_cast<int>(object) == step.mode.object) {
        for (std::size_t bin = 0; bin < logs.size(); ++bin) {
          const double mm =
              pose_error_mm(displaced_body(task.hypotheses[object].map), step.symmetry, step.pose(),
                            recogniser.lattice().T_object_robot(static_cast<std::int64_t>(bin)));
          near += mm <= neighbourhood_mm ? step.identity[object] * std::exp(logs[bin] - top) / sum
                                         : 0.0;
        }
      }
    }
    // A bin of 22.5 degrees is cut by the neighbourhood's edge, not counted as a whole.
    EXPECT_NEAR(step.places.share, near, 0.35);
    double all = 0.0;
    for (const BeliefMode& mode : step.places.modes) {
      all += mode.probability;
      EXPECT_LE(mode.probability, step.identity[static_cast<std::size_t>(mode.object)] + 1e-9);
    }
    EXPECT_LE(all, 1.0 + 1e-9);
    EXPECT_GT(all, 0.5);
    EXPECT_LE(step.places.modes.size(), 5U);
    EXPECT_TRUE(
        std::ranges::is_sorted(step.places.modes, std::greater<>(), &BeliefMode::probability));
  }
}

TEST_F(Places, AreTheSameByBoundsAsByTheHistogram) {
  for (const std::size_t touches : {1U, 2U, 6U}) {
    const RecognitionStep dense = step_by(0, touches);
    const RecognitionStep bounded = step_by(2, touches);
    ASSERT_EQ(bounded.places.modes.size(), dense.places.modes.size());
    for (std::size_t i = 0; i < dense.places.modes.size(); ++i) {
      const BeliefMode& a = dense.places.modes[i];
      const BeliefMode& b = bounded.places.modes[i];
      EXPECT_EQ(a.object, b.object);
      // The histogram rounds in float32.
      EXPECT_NEAR(a.probability, b.probability, 1e-4);
      EXPECT_LT(
          glm::distance(a.pose.T_robot_object.translation_mm, b.pose.T_robot_object.translation_mm),
          1e-2);
    }
    EXPECT_NEAR(dense.places.share, bounded.places.share, 1e-3);
    EXPECT_EQ(dense.places.own, bounded.places.own);
    EXPECT_EQ(dense.decision.act, bounded.decision.act);
  }
}

TEST_F(Places, OfOneLabelWeighAsTheTemperatureHasLabelsWeigh) {
  constexpr double temperature = 2.5;
  for (const std::size_t filter : {0U, 2U}) {
    RecognitionTask task(shapes(), every_filter()[filter]);
    Recogniser recogniser(device, task);
    const auto after = [&](double first, double growth) {
      task.temperature = first;
      task.temperature_growth = growth;
      recogniser.reset();
      // The same touch twice leaves the modes that one touch leaves.
      const Touch touch = recording.touch(0);
      return take_step(recogniser, task, std::vector{touch, touch}, {});
    };
    const RecognitionStep plain = after(1.0, 0.0);
    const RecognitionStep tempered = after(temperature - 0.5, 0.5);
    const auto same = [](const BeliefMode& a) {
      return [&](const BeliefMode& b) {
        return a.object == b.object && a.best.theta_rad == b.best.theta_rad &&
               a.best.translation_mm == b.best.translation_mm;
      };
    };
    std::vector<std::pair<double, double>> weights;  // of modes of the pose's object
    for (const BeliefMode& mode : plain.places.modes) {
      const auto found = std::ranges::find_if(tempered.places.modes, same(mode));
      if (mode.object == plain.mode.object && found != tempered.places.modes.end()) {
        weights.emplace_back(mode.probability, found->probability);
      }
    }
    ASSERT_GE(weights.size(), 2U);
    double all_before = 0.0;
    double all_now = 0.0;
    for (const auto& [before, now] : weights) {
      all_before += before;
      all_now += now;
      const double ratio = before / weights.front().first;
      EXPECT_NEAR(now / weights.front().second, std::pow(ratio, 1.0 / temperature), 1e-6);
    }
    EXPECT_NEAR(all_now, all_before, 1e-5);
    // The bins go with the mode that they are of.
    ASSERT_TRUE(plain.places.own && tempered.places.own);
    EXPECT_NEAR(tempered.places.share / tempered.places.modes[*tempered.places.own].probability,
                plain.places.share / plain.places.modes[*plain.places.own].probability, 0.02);
    EXPECT_LT(tempered.places.share, plain.places.share);
    EXPECT_GT(tempered.places.within_mm.value(), plain.places.within_mm.value());
  }
}

TEST_F(Places, OfAnObjectThatLooksAlikeWhenTurnedAreOneWhicheverHasTheMode) {
  for (const std::size_t filter : {0U, 2U}) {
    std::vector<Hypothesis> maps = shapes();
    maps[1].map.symmetry = 1;  // a disc, which is not the mode's object
    const auto modes_of_disc = [&](std::optional<int> suggested) {
      maps[1].map.suggested_symmetry = suggested;
      RecognitionTask task(maps, every_filter()[filter]);
      task.temperature = 20.0;  // the disc has a share
      Recogniser recogniser(device, task);
      const RecognitionStep step = take_step(recogniser, task, all_touches(recording, 1), {});
      EXPECT_EQ(step.mode.object, 0);
      return std::ranges::count(step.places.modes, 1, &BeliefMode::object);
    };
    const auto apart = modes_of_disc({});
    EXPECT_GT(apart, 1);
    EXPECT_LT(modes_of_disc(0), apart);
  }
}

TEST_F(Places, AreNoneBeforeATouchReachesTheBelief) {
  std::ranges::fill(recording.pressure, 0.0);
  RecognitionTask task(shapes(), every_filter()[2]);
  task.auto_pivot = true;
  Recogniser recogniser(device, task);
  const RecognitionStep step = take_step(recogniser, task, all_touches(recording, 2), {});
  EXPECT_TRUE(step.places.modes.empty());
  EXPECT_FALSE(step.places.within_mm);
  EXPECT_FALSE(step.places.peak);
  EXPECT_THAT(step.warnings, testing::Contains(testing::HasSubstr("no touch has an element In")));
  EXPECT_FALSE(step.decision.act);
}

TEST_F(Places, OfParticlesAreWhereTheHistogramsAre) {
  const RecognitionStep dense = step_by(0, 6);
  const RecognitionStep particles = step_by(1, 6);
  ASSERT_FALSE(dense.places.modes.empty());
  ASSERT_FALSE(particles.places.modes.empty());
  const BeliefMode& a = dense.places.modes.front();
  const BeliefMode& b = particles.places.modes.front();
  EXPECT_EQ(a.object, b.object);
  EXPECT_GT(b.probability, 0.5);
  // Motion noise of 1 mm and 0.1 rad comes between, and bins of 22.5 degrees.
  EXPECT_LT(pose_error_mm(displaced_body(shapes()[a.object].map), 1, inverse(a.pose.T_robot_object),
                          inverse(b.pose.T_robot_object)),
            3.0);
}

}  // namespace palpate::belief_modes_test
