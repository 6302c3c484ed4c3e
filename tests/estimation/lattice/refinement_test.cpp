// The refined pose and its covariance, of known beliefs and of real ones.

#include "estimation/lattice/refinement.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "palpate/error.hpp"
#include "palpate/pose_error.hpp"
#include "palpate/pose_histogram.hpp"
#include "palpate/simulation.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"
#include "support/touched_shape.hpp"

namespace palpate::refinement_test {

/// The refined pose around a bin, as (x_mm, y_mm, theta_rad), and its covariance: xx, yy, tt, xy,
/// xt, yt.
struct Golden {
  std::int64_t bin;
  std::array<double, 3> pose;
  std::array<double, 6> covariance;
};

/// A belief after touches of the letter L, or where there are none, after two of no object in
/// particular. Its refined poses are golden values, from another implementation that looked at
/// every bin of the lattice in float64.
struct Belief {
  const char* name;
  std::size_t letter_touches;
  PoseLattice lattice;
  std::vector<Golden> golden;

  friend void PrintTo(const Belief& belief, std::ostream* out) { *out << belief.name; }
};

const std::vector<Belief> beliefs{
    {"FullCircle",
     0,
     {{-4, 4, 19}, {-4, 4, 18}, {0, two_pi, 41}, {}},
     {{5909,
       {-2.22775, -1.3417, 2.70453},
       {2.14348, 0.629905, 0.0379121, 0.131164, 0.0911046, -0.0984945}},
      {4674,
       {-2.12507, 1.50882, 2.06902},
       {1.79962, 1.96382, 0.0645964, 0.48476, -0.180177, -0.194169}},
      {14021,
       {2.14392, 1.68133, 6.20776},
       {0.682666, 1.19587, 0.0765286, -0.65748, -0.112531, 0.117026}}}},
    {"CircleFromElsewhere",
     0,
     {{-4, 4, 19}, {-4, 4, 18}, {-2, two_pi - 2, 40}, {}},
     {{4627,
       {0.687325, -0.0860092, 0.189864},
       {0.42561, 0.894296, 0.108695, -0.00620218, -0.0089237, 0.217849}},
      {9120,
       {-2.12761, 1.50922, 2.15167},
       {2.0307, 2.83223, 0.0700918, 1.7007, -0.259874, -0.365763}}}},
    {"PartOfTheCircle",
     0,
     {{-4, 4, 19}, {-3, 5, 18}, {0.3, 2.3, 14}, {}},
     {{4694,
       {-1.28683, 2.83271, 1.88108},
       {3.40162, 0.282431, 0.0940266, -0.28081, -0.511413, 0.0174265}},
      {3192,
       {-2.1671, -0.134739, 1.65219},
       {1.32743, 1.56875, 0.111423, 0.533553, 0.0285971, -0.184669}},
      {0,
       {-1.72687, -1.12581, 0.716665},
       {1.6182, 1.04389, 0.0376271, 0.438418, -0.0209397, -0.0757507}}}},
    {"CoarserThanTheWindow",
     0,
     {{-15, 15, 5}, {-16, 16, 4}, {0, two_pi, 3}, {}},
     {{11, {-5.82056, 3.79698, 1.00823}, {9.84406, 17.5774, 2.07485, 0.521215, -1.99704, -2.82422}},
      {59,
       {5.80222, 3.99283, 5.23724},
       {28.5389, 13.0975, 0.930516, -1.9119, -0.150732, 0.100694}}}},
    {"TwoAngles",
     0,
     {{-4, 4, 11}, {-4, 4, 12}, {0, two_pi, 2}, {}},
     {{169,
       {-0.71092, -1.4987, 5.28006},
       {0.406942, 0.867149, 1.41965, 0.260538, -0.0115693, -0.129315}},
      {88,
       {-1.97139, 1.60193, 2.12217},
       {1.64834, 0.85684, 1.27448, -0.489748, -0.504694, 0.228045}}}},
    {"PivotFarAway",
     0,
     {{-4, 4, 19}, {-4, 4, 18}, {0, two_pi, 41}, {300, -200}},
     {{4674,
       {-34.4501, -357.594, 2.06902},
       {8202.43, 82.0141, 0.0645964, -813.254, 23.0166, -2.28225}}}},
    {"ObjectFarFromThePivot",
     0,
     {{26, 34, 19}, {-4, 4, 18}, {0, two_pi, 41}, {}},
     {{0,
       {27.6915, -0.0153257, 0.237799},
       {0.927129, 4.64061, 0.0133669, 0.0420552, 0.00161122, 0.180379}},
      {14021,
       {32.1895, 0.0358423, 6.0632},
       {0.960448, 4.58101, 0.0118594, -0.0760611, -0.00291406, 0.159156}}}},
    {"FixedX",
     0,
     {{0.7, 0.7, 1}, {-4, 4, 18}, {0, two_pi, 41}, {}},
     {{689, {0.7, -1.20124, 6.03012}, {0, 0.476578, 0.0289912, 0, 0, 0.0555166}},
      {246, {0.7, 1.52272, 2.04762}, {0, 1.72557, 0.0384075, 0, 0, -0.0177916}}}},
    {"FixedAngle",
     0,
     {{-4, 4, 19}, {-4, 4, 18}, {0.4, 0.4, 1}, {5, 6}},
     {{199, {-2.03927, -7.16914, 0.4}, {0.615667, 0.507748, 0, -0.201691, 0, 0}},
      {341, {-0.130714, -5.41782, 0.4}, {1.63124, 1.26919, 0, 1.10936, 0, 0}}}},
    {"OneBinOfEachAxis",
     0,
     {{-1, 1, 1}, {-2, 2, 1}, {0, two_pi, 1}, {3, 4}},
     {{0, {3, 4, 3.14159}, {52.9712, 30.9421, 3.28987, -39.4784, -13.1595, 9.8696}}}},
    {"APoint",
     0,
     {{1, 1, 1}, {2, 2, 1}, {3, 3, 1}, {3, 4}},
     {{0, {4.53446, 5.53661, 3}, {0, 0, 0, 0, 0, 0}}}},
    {"SharpOnCoarseBins",
     50,
     {{-5.4, 5.4, 7}, {-5.4, 5.4, 7}, {0, two_pi, 28}, {}},
     {{171,
       {0.225042, -0.0641293, 0.780428},
       {0.00271099, 0.00581566, 0.000120147, -0.000267796, -4.26226e-05, 6.78475e-05}},
      {457,
       {0.0325565, -1.5733, 1.4831},
       {0.199427, 0.199294, 0.00479677, -0.000991138, 0.000797806, -0.000746028}},
      {686, {-4.62857, -0.0122098, 3.69284}, {0.198367, 0.198516, 0.00429135, 0, 0, 0.000119063}}}},
    {"SharpOnFineBins",
     50,
     {{-1.5, 1.5, 15}, {-1.5, 1.5, 15}, {0.4, 1.2, 20}, {1, 2}},
     {{2123,
       {1.00346, -2.27005, 0.796524},
       {0.0028774, 0.00488462, 0.000127633, 0.000117182, 0.000341211, 0.000103848}}}},
    {"BroadOnFineBins",
     3,
     {{-3, 3, 24}, {-3, 3, 24}, {0, two_pi, 60}, {}},
     {{4285,
       {0.37895, -0.191051, 0.810742},
       {0.0422053, 0.0466059, 0.00250585, -0.00188684, -0.0042153, -0.000586294}},
      {11520,
       {-0.501611, -1.69366, 1.75754},
       {0.0614759, 0.0478021, 0.0547532, -0.00972419, -0.0265236, 0.00982005}},
      {17280,
       {-2.03423, -2.05199, 3.13812},
       {0.542509, 0.67451, 0.133333, 0.545091, 0.237229, 0.294379}}}},
};

/// Expects a refined pose within a tolerance in mm and rad.
void expect_near(const RefinedPose& pose, const Golden& golden, double tolerance, double lever_mm) {
  EXPECT_NEAR(pose.T_object_robot.translation_mm.x, golden.pose[0], tolerance * (1.0 + lever_mm));
  EXPECT_NEAR(pose.T_object_robot.translation_mm.y, golden.pose[1], tolerance * (1.0 + lever_mm));
  EXPECT_NEAR(wrap_angle(pose.T_object_robot.theta_rad - golden.pose[2], two_pi), 0.0, tolerance);
  constexpr int rows[] = {0, 1, 2, 0, 0, 1};
  constexpr int columns[] = {0, 1, 2, 1, 2, 2};
  for (std::size_t i = 0; i < 6; ++i) {
    const double larger = std::max(golden.covariance[rows[i]], golden.covariance[columns[i]]);
    const double entry = pose.covariance[3 * rows[i] + columns[i]];
    EXPECT_NEAR(entry, golden.covariance[i], tolerance * larger) << rows[i] << columns[i];
    EXPECT_EQ(entry, pose.covariance[3 * columns[i] + rows[i]]) << "not symmetric";
  }
}

class Refinement : public testing::TestWithParam<Belief> {};

TEST_P(Refinement, HasTheGoldenPosesAndCovariances) {
  const auto& [name, letter_touches, lattice, golden] = GetParam();
  const bool letter = letter_touches > 0;
  const Hypothesis object{letter ? map_of(on_letter_l, "L") : random_map(21, 17, 0.5, 4.0, 131)};
  // About the pivot, or else nothing of the object is touched.
  const Recording recording =
      moved(letter ? touches_of(on_letter_l, {{0.3, -0.2}, 0.8}, letter_touches, 7)
                   : random_recording(2, 36, 132),
            {lattice.pivot_mm, 0.0});
  Device device = Device::open();
  PoseHistogram histogram(device, std::span(&object, 1), {.lattice = lattice});
  histogram.update(all_touches(recording));
  const reference::Posterior expected =
      reference_posterior(std::span(&object, 1), {.lattice = lattice}, all_touches(recording));
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

TEST(RefinedPose, OfAUniformBeliefIsTheBinsOwnAndSoIsThatOfTies) {
  const Hypothesis object{random_map(21, 21, 0.5, 4.0, 137), 1.0};
  const PoseLattice lattice{{-8, 8, 33}, {-8, 8, 33}, {0, two_pi, 30}, {}};
  Device device = Device::open();
  const PoseHistogram histogram(device, std::span(&object, 1), {.lattice = lattice});
  Mode mode{.bin = (7 * lattice.plane()) + 16 * 33 + 16};
  // The window is symmetric only about the centroid's image, so ask for an angle alone.
  const RefinedPose refined = histogram.refine(mode);
  EXPECT_NEAR(refined.T_object_robot.theta_rad, lattice.T_object_robot(*mode.bin).theta_rad,
              lattice.theta_rad.step() / 2);
  for (const int variance : {0, 4}) {
    // A ball of 2.5 mm: a fifth of the radius's square along each axis.
    EXPECT_NEAR(refined.covariance[variance], 2.5 * 2.5 / 5.0, 0.3);
  }
  mode.bin = 0;
  EXPECT_GT(histogram.refine(mode).T_object_robot.translation_mm.x, -8.0) << "within the region";
}

TEST(RefinedPose, ErrsLessThanTheModeAndKnowsByHowMuch) {
  Device device = Device::open();
  Simulator simulator(make_shape("A"), SensorModel{}, digitacts_array(), 1401);
  MapBuilder builder(device, {});
  builder.add(all_touches(simulator.touch(training_grid(), Pose{})));
  const Hypothesis object{builder.build("A"), 1.0};
  const Body body = body_of(object.map);
  double modes = 0.0;
  double refined = 0.0;
  double normalised = 0.0;
  constexpr int unknowns = 8;
  for (std::uint64_t seed = 0; seed < unknowns; ++seed) {
    const Pose truth = random_object_pose(seed);
    std::vector<Pose> poses = random_poses(15, seed);
    for (Pose& pose : poses) {
      pose = inverse(truth) * pose;
    }
    // The bins of 64 x 64 x 244 over the whole region, around the truth only, which lies up to two
    // fifths of a bin off.
    PoseLattice lattice{{-2.5, 2.5, 16}, {-2.5, 2.5, 16}, {-0.4, 0.4, 31}, {}};
    Uniform random(seed);
    for (const auto& [axis, at] : {std::pair(&lattice.x_mm, truth.translation_mm.x),
                                   {&lattice.y_mm, truth.translation_mm.y},
                                   {&lattice.theta_rad, truth.theta_rad}}) {
      const double by = at + random(-0.4, 0.4) * axis->step();
      axis->lower += by;
      axis->upper += by;
    }
    PoseHistogram histogram(device, std::span(&object, 1), {.lattice = lattice});
    histogram.update(all_touches(simulator.touch(poses, truth)));
    const Mode mode = histogram.estimate().mode;
    const RefinedPose pose = histogram.refine(mode);
    modes += pose_error_mm(body, 1, mode.T_object_robot, truth) / unknowns;
    refined += pose_error_mm(body, 1, pose.T_object_robot, truth) / unknowns;
    glm::dmat3 covariance;
    for (int k = 0; k < 9; ++k) {
      covariance[k / 3][k % 3] = pose.covariance[k];
    }
    const glm::dvec3 error(pose.T_object_robot.translation_mm - truth.translation_mm,
                           wrap_angle(pose.T_object_robot.theta_rad - truth.theta_rad, two_pi));
    normalised += glm::dot(error, glm::inverse(covariance) * error) / unknowns;
  }
  // `./dev bench sweep` measures 0.36 and 0.15 mm for touches anywhere.
  EXPECT_LT(refined, 0.2);
  EXPECT_LT(refined, 0.8 * modes);
  // 3 for a covariance that is exact; Eq. 7 is less sure than this sensor deserves.
  EXPECT_LT(normalised, 3.0);
  EXPECT_GT(normalised, 0.3);
}

TEST(RefinedPose, OfWhatIsNotThereIsRefused) {
  const Hypothesis object{random_map(5, 4, 0.5, 1.0, 139), 1.0};
  Device device = Device::open();
  const PoseHistogram histogram(device, std::span(&object, 1), {});
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

}  // namespace palpate::refinement_test
