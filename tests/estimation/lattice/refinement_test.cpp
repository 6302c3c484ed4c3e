#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>
#include <string>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "estimation/lattice/refinement.hpp"
#include "palpate/error.hpp"
#include "palpate/pose_error.hpp"
#include "palpate/pose_histogram.hpp"
#include "palpate/simulation.hpp"
#include "plain_refinement.hpp"
#include "support/synthetic.hpp"

namespace palpate::refinement_test {

/// `lever_mm` is how far from the robot's origin, where a turn shows, the poses are compared.
void expect_near(const RefinedPose& a, const RefinedPose& b, double lever_mm = 0.0) {
  // Logs that are 1e-4 nats off per touch move a mean within 2.5 mm by at most some 1e-3 mm.
  const double tolerance_mm = 1e-3 * (1.0 + lever_mm);
  EXPECT_NEAR(a.T_object_robot.translation_mm.x, b.T_object_robot.translation_mm.x, tolerance_mm);
  EXPECT_NEAR(a.T_object_robot.translation_mm.y, b.T_object_robot.translation_mm.y, tolerance_mm);
  EXPECT_NEAR(wrap_angle(a.T_object_robot.theta_rad - b.T_object_robot.theta_rad, two_pi), 0.0,
              1e-3);
  for (int i = 0; i < 9; ++i) {
    const double larger = std::max(a.covariance[4 * (i / 3)], a.covariance[4 * (i % 3)]);
    EXPECT_NEAR(a.covariance[i], b.covariance[i], 1e-3 * larger + 1e-9) << "entry " << i;
  }
}

/// Boxes of one object's bins, as a belief gives them.
std::vector<double> bins_of(const std::vector<double>& logs, const PoseLattice& lattice,
                            std::span<const BinBox> boxes) {
  std::vector<double> values;
  for (const BinBox& box : boxes) {
    for (std::int64_t i = 0; i < box.bins(); ++i) {
      values.push_back(logs[static_cast<std::size_t>(box.bin(i, lattice))]);
    }
  }
  return values;
}

struct Region {
  const char* name;
  PoseLattice lattice;

  friend void PrintTo(const Region& region, std::ostream* out) { *out << region.name; }
};

class Refinement : public testing::TestWithParam<Region> {};

TEST_P(Refinement, IsThePlainPeakAndCovarianceOfTheReferencesBelief) {
  const PoseLattice& lattice = GetParam().lattice;
  const Hypothesis object{random_map(21, 17, 0.5, 4.0, 131), 1.0};
  Recording recording = random_recording(2, 36, 132);
  // About the pivot, or else nothing of the object is touched.
  recording = moved(recording, {lattice.pivot_mm, 0.0});
  Device device = Device::open();
  PoseHistogram histogram(device, std::span(&object, 1), {.lattice = lattice});
  histogram.update(all_touches(recording));
  const reference::Posterior expected =
      reference_posterior(std::span(&object, 1), {.lattice = lattice}, all_touches(recording));
  // The reference's belief refines as the device's does.
  const auto reference_boxes = [&](std::span<const BinBox> boxes) {
    return bins_of(expected.log_likelihood[0], lattice, boxes);
  };
  Mode mode = histogram.estimate().mode;
  const std::int64_t n = lattice.bins();
  const double lever_mm = std::hypot(lattice.pivot_mm.x, lattice.pivot_mm.y);
  for (const std::int64_t bin :
       {mode.bin.value(), std::int64_t{0}, n - 1, n / 3, n / 2, 2 * n / 3}) {
    SCOPED_TRACE("bin " + std::to_string(bin));
    mode.bin = bin;
    const RefinedPose plain =
        plain_refinement(expected.log_likelihood[0], lattice, object.map, bin);
    expect_near(histogram.refine(mode), plain, lever_mm);
    expect_near(refine(reference_boxes, lattice, displaced_body(object.map), mode), plain,
                lever_mm);
    const RefinedPose from_pose =
        histogram.refine({.bin = {}, .T_object_robot = lattice.T_object_robot(bin)});
    EXPECT_EQ(from_pose.T_object_robot.theta_rad, histogram.refine(mode).T_object_robot.theta_rad);
    EXPECT_EQ(from_pose.covariance, histogram.refine(mode).covariance);
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, Refinement,
    testing::Values(
        Region{"FullCircle", {{-4, 4, 19}, {-4, 4, 18}, {0, two_pi, 41}, {}}},
        Region{"CircleFromElsewhere", {{-4, 4, 19}, {-4, 4, 18}, {-2, two_pi - 2, 40}, {}}},
        Region{"PartOfTheCircle", {{-4, 4, 19}, {-3, 5, 18}, {0.3, 2.3, 14}, {}}},
        Region{"CoarserThanTheWindow", {{-15, 15, 5}, {-16, 16, 4}, {0, two_pi, 3}, {}}},
        Region{"TwoAngles", {{-4, 4, 11}, {-4, 4, 12}, {0, two_pi, 2}, {}}},
        Region{"PivotFarAway", {{-4, 4, 19}, {-4, 4, 18}, {0, two_pi, 41}, {300, -200}}},
        Region{"ObjectFarFromThePivot", {{26, 34, 19}, {-4, 4, 18}, {0, two_pi, 41}, {}}},
        Region{"FixedX", {{0.7, 0.7, 1}, {-4, 4, 18}, {0, two_pi, 41}, {}}},
        Region{"FixedAngle", {{-4, 4, 19}, {-4, 4, 18}, {0.4, 0.4, 1}, {5, 6}}},
        Region{"OneBinOfEachAxis", {{-1, 1, 1}, {-2, 2, 1}, {0, two_pi, 1}, {3, 4}}},
        Region{"APoint", {{1, 1, 1}, {2, 2, 1}, {3, 3, 1}, {3, 4}}}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(RefinedPose, AFixedAxisHasNoVariance) {
  const Hypothesis object{random_map(21, 17, 0.5, 4.0, 133), 1.0};
  const Recording recording = random_recording(2, 36, 134);
  Device device = Device::open();
  PoseHistogram histogram(
      device, std::span(&object, 1),
      {.lattice = {.x_mm = {0.7, 0.7, 5}, .y_mm = {-4, 4, 18}, .theta_rad = {0.4, 0.4, 7}}});
  histogram.update(all_touches(recording));
  const RefinedPose refined = histogram.refine(histogram.estimate().mode);
  EXPECT_EQ(refined.T_object_robot.translation_mm.x, 0.7);
  EXPECT_EQ(refined.T_object_robot.theta_rad, 0.4);
  for (const int entry : {0, 1, 2, 3, 5, 6, 7, 8}) {
    EXPECT_EQ(refined.covariance[entry], 0.0) << entry;
  }
  EXPECT_GT(refined.covariance[4], 1e-3) << "a pose is no point, however few bins hold the belief";
}

TEST(RefinedPose, MovesWithTheRobotFrame) {
  const Hypothesis object{random_map(21, 17, 0.5, 4.0, 135), 1.0};
  const Recording recording = random_recording(2, 36, 136);
  PoseLattice lattice{{-4, 4, 19}, {-4, 4, 18}, {0, two_pi, 41}, {1, 2}};
  const Pose T_moved_robot{{130.0, -70.0}, 0.9};
  PoseLattice moved_lattice = lattice;
  moved_lattice.pivot_mm = T_moved_robot * lattice.pivot_mm;
  moved_lattice.theta_rad.lower -= T_moved_robot.theta_rad;
  moved_lattice.theta_rad.upper -= T_moved_robot.theta_rad;
  Device device = Device::open();
  const auto refined = [&](const PoseLattice& region, const Recording& touches) {
    PoseHistogram histogram(device, std::span(&object, 1), {.lattice = region});
    histogram.update(all_touches(touches));
    return histogram.refine(histogram.estimate().mode);
  };
  const RefinedPose here = refined(lattice, recording);
  const RefinedPose there = refined(moved_lattice, moved(recording, T_moved_robot));
  RefinedPose expected{.T_object_robot = here.T_object_robot * inverse(T_moved_robot)};
  // translation' = translation + R(theta) v, v the old origin as seen from the new frame, so
  // d translation' / d theta = R(theta) turned by a quarter v.
  const glm::dvec2 slope = rotate(here.T_object_robot.theta_rad + std::numbers::pi / 2.0,
                                  inverse(T_moved_robot).translation_mm);
  const double jacobian[3][3] = {{1, 0, slope.x}, {0, 1, slope.y}, {0, 0, 1}};
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) {
      for (int k = 0; k < 9; ++k) {
        expected.covariance[3 * a + b] +=
            jacobian[a][k / 3] * here.covariance[k] * jacobian[b][k % 3];
      }
    }
  }
  expect_near(there, expected, 150.0);
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

TEST(RefinedPose, OfATwoFoldSymmetricObjectKeepsToOneMode) {
  // A bar of 12 x 3 mm about the origin.
  OccupancyGrid bar{.label = "bar", .origin_mm = {-8, -8}, .nx = 33, .ny = 33, .log_odds = {}};
  for (int j = 0; j < 33; ++j) {
    for (int i = 0; i < 33; ++i) {
      const bool on = std::abs(i - 16) <= 12 && std::abs(j - 16) <= 3;
      bar.log_odds.push_back(on ? 4.0F : -4.0F);
    }
  }
  const Hypothesis object{bar, 1.0};
  const Pose T_object_robot{{0.55, -0.35}, 1.03};
  Recording recording;
  recording.elements_mm = digitacts_array();
  Uniform random(138);
  for (int touch = 0; touch < 6; ++touch) {
    const Pose T_robot_sensor =
        inverse(T_object_robot) * Pose{{random(-5, 5), random(-2, 2)}, random(0, two_pi)};
    recording.T_robot_sensor.push_back(T_robot_sensor);
    for (const glm::dvec2& element : recording.elements_mm) {
      const glm::dvec2 p = T_object_robot * (T_robot_sensor * element);
      recording.pressure.push_back(std::abs(p.x) < 6.25 && std::abs(p.y) < 1.75 ? 9.0 : 0.0);
    }
  }
  const PoseLattice lattice{{-3, 3, 20}, {-3, 3, 20}, {0, two_pi, 80}, {}};
  Device device = Device::open();
  PoseHistogram histogram(device, std::span(&object, 1), {.lattice = lattice});
  histogram.update(all_touches(recording));
  Mode mode = histogram.estimate().mode;
  const RefinedPose one = histogram.refine(mode);
  const Body body = body_of(bar);
  EXPECT_LT(pose_error_mm(body, 2, one.T_object_robot, T_object_robot), 0.4) << "a bin's diagonal";
  EXPECT_LT(
      std::abs(wrap_angle(one.T_object_robot.theta_rad - mode.T_object_robot.theta_rad, two_pi)),
      0.2);
  // The other mode: half the circle on, the place mirrored.
  const std::int64_t n = lattice.plane();
  const std::int64_t in_plane = mode.bin.value() % n;
  mode.bin = (*mode.bin / n + 40) % 80 * n + (n - 1 - in_plane);
  const RefinedPose other = histogram.refine(mode);
  EXPECT_NEAR(
      std::abs(wrap_angle(one.T_object_robot.theta_rad - other.T_object_robot.theta_rad, two_pi)),
      std::numbers::pi, 1e-3);
  EXPECT_NEAR(one.covariance[8], other.covariance[8], 1e-4);
}

/// A letter that was learned, and touched in a pose that is to be found.
struct Unknown {
  const Hypothesis& object;
  Recording touches;
  Pose truth;
  std::uint64_t seed = 0;
};

/// Letters without symmetry, a few unknowns of each.
void for_each_unknown(Device& device, int unknowns, int touches,
                      const std::function<void(const Unknown&)>& visit) {
  std::uint64_t seed = 1400;
  for (const char* letter : {"A", "E", "U"}) {
    Simulator simulator(make_shape(letter), SensorModel{}, digitacts_array(), ++seed);
    MapBuilder builder(device, {});
    const Recording training = simulator.touch(training_grid(), Pose{});
    builder.add(all_touches(training));
    const Hypothesis object{builder.build(letter), 1.0};
    for (int i = 0; i < unknowns; ++i) {
      const Pose truth = random_object_pose(++seed);
      std::vector<Pose> poses = random_poses(touches, ++seed);
      for (Pose& pose : poses) {
        pose = inverse(truth) * pose;
      }
      visit({object, simulator.touch(poses, truth), truth, seed});
    }
  }
}

/// A lattice about the truth, shifted by up to two fifths of a bin.
PoseLattice around(const Unknown& unknown, PoseLattice lattice) {
  Uniform random(unknown.seed);
  const Pose& truth = unknown.truth;
  for (const auto& [axis, at] : {std::pair(&lattice.x_mm, truth.translation_mm.x),
                                 {&lattice.y_mm, truth.translation_mm.y},
                                 {&lattice.theta_rad, truth.theta_rad}}) {
    const double by = at + random(-0.4, 0.4) * axis->step();
    axis->lower += by;
    axis->upper += by;
  }
  return lattice;
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

TEST(RefinedPose, ErrsLessThanTheModeAndKnowsByHowMuch) {
  Device device = Device::open();
  std::vector<double> modes;
  std::vector<double> refined;
  std::vector<double> normalised;
  for_each_unknown(device, 4, 15, [&](const Unknown& unknown) {
    // The bins of 64 x 64 x 244 over the whole region, around the truth only.
    const PoseLattice lattice =
        around(unknown, {{-2.5, 2.5, 16}, {-2.5, 2.5, 16}, {-0.4, 0.4, 31}, {}});
    PoseHistogram histogram(device, std::span(&unknown.object, 1), {.lattice = lattice});
    histogram.update(all_touches(unknown.touches));
    const Mode mode = histogram.estimate().mode;
    const RefinedPose pose = histogram.refine(mode);
    const Body body = body_of(unknown.object.map);
    modes.push_back(pose_error_mm(body, 1, mode.T_object_robot, unknown.truth));
    refined.push_back(pose_error_mm(body, 1, pose.T_object_robot, unknown.truth));
    glm::dmat3 covariance;
    for (int k = 0; k < 9; ++k) {
      covariance[k / 3][k % 3] = pose.covariance[k];
    }
    const glm::dvec3 error(
        pose.T_object_robot.translation_mm - unknown.truth.translation_mm,
        wrap_angle(pose.T_object_robot.theta_rad - unknown.truth.theta_rad, two_pi));
    normalised.push_back(glm::dot(error, glm::inverse(covariance) * error));
  });
  // `./dev bench sweep` measures 0.36 and 0.15 mm for touches anywhere.
  EXPECT_LT(mean(refined), 0.2);
  EXPECT_LT(mean(refined), 0.8 * mean(modes));
  // 3 for a covariance that is exact; Eq. 7 is less sure than this sensor deserves.
  EXPECT_LT(mean(normalised), 3.0);
  EXPECT_GT(mean(normalised), 0.3);
}

TEST(RefinedPose, LiesBetweenCoarseBinsAfterManyTouches) {
  Device device = Device::open();
  std::vector<double> after_15;
  std::vector<double> after_50;
  for_each_unknown(device, 8, 50, [&](const Unknown& unknown) {
    // The bins of 13 x 13 x 55 over the whole region, around the truth only.
    const PoseLattice lattice =
        around(unknown, {{-5.4, 5.4, 7}, {-5.4, 5.4, 7}, {-0.8, 0.8, 14}, {}});
    PoseHistogram histogram(device, std::span(&unknown.object, 1), {.lattice = lattice});
    const auto refined_error_mm = [&] {
      const RefinedPose pose = histogram.refine(histogram.estimate().mode);
      return pose_error_mm(body_of(unknown.object.map), 1, pose.T_object_robot, unknown.truth);
    };
    histogram.update(unknown.touches.touches(0, 15));
    after_15.push_back(refined_error_mm());
    histogram.update(unknown.touches.touches(15, 50));
    after_50.push_back(refined_error_mm());
  });
  // Nearly all of the belief is in one bin by then, of 1.5 mm: where the bin is says little.
  EXPECT_LT(mean(after_50), 0.85 * mean(after_15));
  EXPECT_LT(mean(after_50), 0.3);
}

TEST(RefinedPose, OfWhatIsNotThereIsRefused) {
  const Hypothesis object{random_map(5, 4, 0.5, 1.0, 139), 1.0};
  Device device = Device::open();
  const PoseHistogram histogram(device, std::span(&object, 1), {});
  const Pose nowhere{{std::numeric_limits<double>::quiet_NaN(), 0.0}, 0.0};
  for (const Mode& mode :
       {Mode{.object = 1}, Mode{.object = -1}, Mode{.bin = -1},
        Mode{.bin = histogram.lattice().bins()}, Mode{.T_object_robot = nowhere}}) {
    EXPECT_THROW(histogram.refine(mode), Error);
  }
}

TEST(RefinedPose, OfAMapWithoutAnOccupiedCellIsFinite) {
  OccupancyGrid map = random_map(9, 7, 0.5, 1.0, 140);
  for (float& l : map.log_odds) {
    l = -std::abs(l);
  }
  const Hypothesis object{map, 1.0};
  Device device = Device::open();
  const PoseHistogram histogram(device, std::span(&object, 1), {});
  const RefinedPose refined = histogram.refine(histogram.estimate().mode);
  EXPECT_TRUE(std::isfinite(refined.T_object_robot.translation_mm.x));
  EXPECT_GE(refined.covariance[0], 0.8 * 0.8 / 12.0);
}

}  // namespace palpate::refinement_test
