// The refined pose and its covariance, of known beliefs and of real ones.

#include "estimation/lattice/refinement.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "palpate/error.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/limits.hpp"
#include "support/shared_device.hpp"
#include "support/synthetic.hpp"
#include "support/touched_shape.hpp"

namespace palpate::refinement_test {

/// The refined pose around a bin: x_mm, y_mm, theta_rad, and its covariance xx, yy, tt, xy, xt, yt.
struct Golden {
  std::int64_t bin;
  std::array<double, 9> numbers;
};

/// A belief after touches of the letter L, or where there are none, after two of no object in
/// particular. Its refined poses are golden values, from another implementation that looked at
/// every bin of the lattice in float64.
struct Belief {
  const char* name;
  PoseLattice lattice;
  std::vector<Golden> golden;
  std::size_t letter_touches = 0;

  friend void PrintTo(const Belief& belief, std::ostream* out) { *out << belief.name; }
};

const std::vector<Belief> beliefs{
    {"FullCircle",
     {{-4, 4, 19}, {-4, 4, 18}, {0, two_pi, 41}, {}},
     {{5909, {-2.2278, -1.3417, 2.7045, 2.1435, 0.62991, 0.037912, 0.13116, 0.091105, -0.098495}},
      {4674, {-2.1251, 1.5088, 2.069, 1.7996, 1.9638, 0.064596, 0.48476, -0.18018, -0.19417}},
      {14021, {2.1439, 1.6813, 6.2078, 0.68267, 1.1959, 0.076529, -0.65748, -0.11253, 0.11703}},
      {0, {-2.1255, -1.6637, 0.079762, 0.85941, 1.4006, 0.072047, 0.31306, 0.10824, -0.078496}}}},
    {"CircleFromElsewhere",
     {{-4, 4, 19}, {-4, 4, 18}, {-2, two_pi - 2, 40}, {}},
     {{4627,
       {0.68732, -0.086009, 0.18986, 0.42561, 0.8943, 0.10869, -0.0062022, -0.0089237, 0.21785}},
      {13679, {2.1917, 1.6049, 4.1869, 0.60242, 1.1924, 0.10279, 0.065748, 0.053598, 0.25229}}}},
    {"PartOfTheCircle",
     {{-4, 4, 19}, {-3, 5, 18}, {0.3, 2.3, 14}, {}},
     {{4694, {-1.2868, 2.8327, 1.8811, 3.4016, 0.28243, 0.094027, -0.28081, -0.51141, 0.017427}},
      {0, {-1.7269, -1.1258, 0.71667, 1.6182, 1.0439, 0.037627, 0.43842, -0.02094, -0.075751}},
      {4787, {1.9999, 2.6603, 1.9013, 2.3881, 0.34028, 0.052628, -0.27398, -0.28757, 0.065866}}}},
    {"CoarserThanTheWindow",
     {{-15, 15, 5}, {-16, 16, 4}, {0, two_pi, 3}, {}},
     {{11, {-5.8206, 3.797, 1.0082, 9.8441, 17.577, 2.0748, 0.52121, -1.997, -2.8242}},
      {0, {-5.7375, -3.0869, 0.9921, 9.6504, 46.762, 2.0903, 5.5336, -1.9533, -2.9271}},
      {20, {-5.7375, -3.0869, 3.0926, 9.6504, 46.762, 3.8529, 5.5336, 2.3587, -5.4413}}}},
    {"TwoAngles",
     {{-4, 4, 11}, {-4, 4, 12}, {0, two_pi, 2}, {}},
     {{169, {-0.71092, -1.4987, 5.2801, 0.40694, 0.86715, 1.4196, 0.26054, -0.011569, -0.12932}},
      {0, {-2.0456, -2.0715, 2.3798, 0.64116, 0.639, 3.4843, 0.23287, 0.16369, 0.14858}},
      {263, {2.0278, 1.9675, 5.5058, 1.049, 0.92303, 3.7566, 0.11419, -0.060962, 0.37364}}}},
    {"PivotFarAway",
     {{-4, 4, 19}, {-4, 4, 18}, {0, two_pi, 41}, {300, -200}},
     {{4674, {-34.45, -357.59, 2.069, 8202.4, 82.014, 0.064596, -813.25, 23.017, -2.2822}}}},
    {"ObjectFarFromThePivot",
     {{26, 34, 19}, {-4, 4, 18}, {0, two_pi, 41}, {}},
     {{0, {27.6915, -0.015326, 0.2378, 0.92713, 4.6406, 0.013367, 0.042055, 0.0016112, 0.18038}},
      {14021,
       {32.1895, 0.035842, 6.0632, 0.96045, 4.581, 0.011859, -0.076061, -0.0029141, 0.15916}}}},
    {"FixedX",
     {{0.7, 0.7, 1}, {-4, 4, 18}, {0, two_pi, 41}, {}},
     {{689, {0.7, -1.2012, 6.0301, 0, 0.47658, 0.028991, 0, 0, 0.055517}},
      {737, {0.7, 1.5294, 6.1988, 0, 1.6989, 0.042328, 0, 0, -0.13966}}}},
    {"FixedAngle",
     {{-4, 4, 19}, {-4, 4, 18}, {0.4, 0.4, 1}, {5, 6}},
     {{199, {-2.0393, -7.1691, 0.4, 0.61567, 0.50775, 0, -0.20169, 0, 0}},
      {114, {-4.0024, -7.8896, 0.4, 1.4561, 0.99076, 0, 0.46336, 0, 0}}}},
    {"OneBinOfEachAxis",
     {{-1, 1, 1}, {-2, 2, 1}, {0, two_pi, 1}, {3, 4}},
     {{0, {3, 4, 3.1416, 52.971, 30.942, 3.2899, -39.478, -13.159, 9.8696}}}},
    {"APoint",
     {{1, 1, 1}, {2, 2, 1}, {3, 3, 1}, {3, 4}},
     {{0, {4.5345, 5.5366, 3, 0, 0, 0, 0, 0, 0}}}},
    {"SharpOnCoarseBins",
     {{-5.4, 5.4, 7}, {-5.4, 5.4, 7}, {0, two_pi, 28}, {}},
     {{171,
       {0.22504, -0.064129, 0.78043, 0.002711, 0.0058157, 0.00012015, -0.0002678, -4.2623e-05,
        6.7848e-05}},
      {457,
       {0.032557, -1.5733, 1.4831, 0.19943, 0.19929, 0.0047968, -0.00099114, 0.00079781,
        -0.00074603}},
      {686, {-4.6286, -0.01221, 3.6928, 0.19837, 0.19852, 0.0042914, 0, 0, 0.00011906}}},
     50},
    {"SharpOnFineBins",
     {{-1.5, 1.5, 15}, {-1.5, 1.5, 15}, {0.4, 1.2, 20}, {1, 2}},
     {{2123,
       {1.0035, -2.2701, 0.79652, 0.0028774, 0.0048846, 0.00012763, 0.00011718, 0.00034121,
        0.00010385}}},
     50},
    {"BroadOnFineBins",
     {{-3, 3, 24}, {-3, 3, 24}, {0, two_pi, 60}, {}},
     {{4285,
       {0.37895, -0.19105, 0.81074, 0.042205, 0.046606, 0.0025059, -0.0018868, -0.0042153,
        -0.00058629}},
      {11520,
       {-0.50161, -1.6937, 1.7575, 0.061476, 0.047802, 0.054753, -0.0097242, -0.026524, 0.00982}},
      {17280, {-2.0342, -2.052, 3.1381, 0.54251, 0.67451, 0.13333, 0.54509, 0.23723, 0.29438}}},
     3}};

/// Expects a refined pose within a tolerance in mm and rad.
void expect_near(const RefinedPose& refined, const Golden& golden, double tolerance,
                 double lever_mm) {
  const auto& [translation_mm, theta_rad] = refined.T_object_robot;
  const std::array<double, 9>& expected = golden.numbers;
  EXPECT_NEAR(translation_mm.x, expected[0], tolerance * (1.0 + lever_mm));
  EXPECT_NEAR(translation_mm.y, expected[1], tolerance * (1.0 + lever_mm));
  EXPECT_NEAR(wrap_angle(theta_rad - expected[2], two_pi), 0.0, tolerance);
  constexpr std::pair<int, int> entries[] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
  for (std::size_t i = 0; i < 6; ++i) {
    const auto [row, column] = entries[i];
    const double entry = refined.covariance[3 * row + column];
    EXPECT_NEAR(entry, expected[3 + i],
                tolerance * std::max(expected[3 + row], expected[3 + column]))
        << row << column;
    EXPECT_EQ(entry, refined.covariance[3 * column + row]) << "not symmetric";
  }
}

class Refinement : public testing::TestWithParam<Belief> {};

TEST_P(Refinement, HasTheGoldenPosesAndCovariances) {
  const auto& [name, lattice, golden, letter_touches] = GetParam();
  const bool letter = letter_touches > 0;
  const Hypothesis object{letter ? map_of(on_letter_l, "L") : random_map(21, 17, 0.5, 4.0, 131)};
  // About the pivot, or else nothing of the object is touched.
  const Recording recording =
      moved(letter ? touches_of(on_letter_l, {{0.3, -0.2}, 0.8}, letter_touches, 7)
                   : random_recording(2, 36, 132),
            {lattice.pivot_mm, 0.0});
  PoseHistogram histogram(shared_device(), std::span(&object, 1), {.lattice = lattice});
  histogram.update(all_touches(recording));
  const reference::Posterior expected = reference_posterior(
      std::span(&object, 1), HistogramOptions{.lattice = lattice}, all_touches(recording));
  const auto in_boxes = [&](std::span<const BinBox> boxes) {
    std::vector<double> values;
    for (const BinBox& box : boxes) {
      for (std::int64_t i = 0; i < box.bins(); ++i) {
        values.push_back(expected.log_likelihood[0][box.bin(i, lattice)]);
      }
    }
    return values;
  };
  const double lever_mm = std::hypot(lattice.pivot_mm.x, lattice.pivot_mm.y);
  for (const Golden& one : golden) {
    SCOPED_TRACE(one.bin);
    expect_near(refine(in_boxes, lattice, displaced_body(object.map), {.bin = one.bin}), one, 2e-4,
                lever_mm);
    // Logs that are 1e-4 nats off per touch move a mean within 2.5 mm by at most some 1e-3 mm.
    const RefinedPose on_device = histogram.refine({.bin = one.bin});
    expect_near(on_device, one, 1e-3, lever_mm);
    const RefinedPose from_pose =
        histogram.refine({.bin = {}, .T_object_robot = lattice.T_object_robot(one.bin)});
    EXPECT_EQ(from_pose.T_object_robot.theta_rad, on_device.T_object_robot.theta_rad);
    EXPECT_EQ(from_pose.covariance, on_device.covariance);
  }
}

INSTANTIATE_TEST_SUITE_P(Beliefs, Refinement, testing::ValuesIn(beliefs),
                         [](const auto& each) { return std::string(each.param.name); });

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

TEST(RefinedPose, OfWhatIsNotThereIsRefused) {
  const Hypothesis object{random_map(5, 4, 0.5, 1.0, 139), 1.0};
  const PoseHistogram histogram(shared_device(), std::span(&object, 1), {});
  for (const Mode& mode :
       {Mode{.object = 1}, Mode{.object = -1}, Mode{.bin = -1},
        Mode{.bin = histogram.lattice().bins()}, Mode{.T_object_robot = {{nan, 0.0}, 0.0}}}) {
    EXPECT_THROW(histogram.refine(mode), Error);
  }
}

TEST(DisplacedBody, OfAMapWithoutAnOccupiedCellIsTheWholeGrid) {
  OccupancyGrid map = random_map(9, 7, 0.5, 1.0, 140);
  map.log_odds.assign(map.log_odds.size(), -1.0F);
  const Body whole = displaced_body(map);
  EXPECT_EQ(whole.centroid_mm, map.origin_mm + glm::dvec2(2.0, 1.5));
  EXPECT_DOUBLE_EQ(whole.inertia_mm2, (4.5 * 4.5 + 3.5 * 3.5) / 12.0);
  map.log_odds[10] = 1.0F;
  EXPECT_EQ(displaced_body(map).centroid_mm, map.centre_mm(1, 1));
}

/// Bins 0.1 mm apart within 2 mm, with logs that fall by `nats` over the first millimetre from the
/// middle and with its square.
std::vector<BodyWindow::Bin> parabola(double nats) {
  std::vector<BodyWindow::Bin> bins;
  for (int i = -20; i <= 20; ++i) {
    const double mm = 0.1 * i;
    bins.push_back({.moved_mm = {mm, 0.0, 0.0}, .log_likelihood = -1e6 - nats * mm * mm});
  }
  return bins;
}

TEST(FlatteningRoot, SpreadsASharpBeliefByAThirdOfItsWindow) {
  // A normal distribution: its variance is root / (2 nats), a third of the window's own is 0.394
  // mm.
  const double window_mm = 0.1 * std::sqrt((41.0 * 41.0 - 1.0) / 12.0);
  for (const double nats : {100.0, 1e3, 1e4, 1e9}) {
    const double root = flattening_root(parabola(nats), 8.0);
    EXPECT_NEAR(std::sqrt(root / (2.0 * nats)), window_mm / 3.0, 0.03) << nats;
  }
}

TEST(FlatteningRoot, OfOneBinOrOneThatHasItAllIsFinite) {
  EXPECT_EQ(flattening_root(std::vector<BodyWindow::Bin>{{.log_likelihood = -5.0}}, 8.0), 8.0);
  const std::vector<BodyWindow::Bin> certain{
      {}, {.moved_mm = {1.0, 0.0, 0.0}, .log_likelihood = -1e30}};
  EXPECT_TRUE(std::isfinite(flattening_root(certain, 8.0)));
}

}  // namespace palpate::refinement_test
