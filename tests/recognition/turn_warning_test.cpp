#include <algorithm>
#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "recognition/decision.hpp"
#include "shapes.hpp"

namespace palpate::turn_warning_test {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST(SymmetryTold, IsTheMapsUnlessTurnsWeighAsTheTemperatureHasThem) {
  OccupancyGrid map{.symmetry = 1, .suggested_symmetry = 2};
  const Axis theta{0.0, 2.0 * std::numbers::pi, 8};
  // A hundredth lies half a turn away, across the end of the circle, too.
  std::vector<double> shares(8);
  shares[7] = 0.99;
  shares[3] = 0.01;
  const auto told = [&](double temperature) {
    return symmetry_told(map, theta, shares, theta.centre(7), temperature);
  };
  EXPECT_EQ(told(1.0), 1);
  // 99^(1 / T) = 19
  EXPECT_EQ(told(std::log(99.0) / std::log(19.0) - 0.01), 1);
  EXPECT_EQ(told(std::log(99.0) / std::log(19.0) + 0.01), 2);
  shares[6] = shares[0] = 0.5;  // nearer than a quarter of a turn
  EXPECT_EQ(told(1.0), 1);
  map.suggested_symmetry = 0;
  EXPECT_EQ(told(1.0), 0) << "all turns look alike";
  map.symmetry = 3;
  EXPECT_EQ(told(9.0), 3) << "as the user says";
}

/// The step after 9 touches of a letter whose map suggests one symmetry and has another; the truth,
/// if any, is turned so far.
RecognitionStep step_of(const std::string& letter, int suggested, int symmetry,
                        std::optional<double> turn_rad) {
  std::vector<Hypothesis> maps = learned_letters();
  OccupancyGrid& map =
      std::ranges::find(maps, letter, [](const Hypothesis& one) { return one.map.label; })->map;
  map.suggested_symmetry = suggested;
  map.symmetry = symmetry;
  Recording recording = letter_touches(letter, 9, 11);
  if (turn_rad) {
    // Turned in the object frame, about the letter's middle.
    recording.truth->T_object_robot = Pose{{}, *turn_rad} * recording.truth->T_object_robot;
  } else {
    recording.truth.reset();
  }
  const RecognitionTask task(maps, HistogramOptions{});
  const RecognitionStep step = last_step(task, recording);
  EXPECT_EQ(task.labels[step.best], letter);
  return step;
}

TEST(TurnWarning, TurnsThatTouchesDoNotTellApartCountAsEqual) {
  const RecognitionStep o = step_of("O", 0, 1, 2.0);
  EXPECT_THAT(o.warnings, ElementsAre(AllOf(HasSubstr("O looks the same after any turn"),
                                            HasSubstr("they count as equal"),
                                            HasSubstr("`symmetry 0`"), HasSubstr("`symmetry 1`"))));
  EXPECT_EQ(o.symmetry, 0);
  EXPECT_LT(*o.error_mm, 1.0);
  EXPECT_LT(*o.refined_error_mm, 1.0);
  EXPECT_EQ(o.T_robot_object().theta_rad, 0.0);
  EXPECT_EQ(o.true_T_robot_object()->theta_rad, 0.0);
  const RecognitionStep i = step_of("I", 2, 1, {});
  EXPECT_THAT(i.warnings, ElementsAre(AllOf(HasSubstr("I looks the same after every 1/2 of a turn"),
                                            HasSubstr("`symmetry 2`"))));
  EXPECT_EQ(i.symmetry, 2);
}

TEST(LeastTurned, ThetaOfSymmetricObjectsLiesWithinOneTurnOfThem) {
  const RecognitionStep plain = step_of("I", 2, 1, 0.0);
  ASSERT_TRUE(plain.refined);
  for (const int n : {2, 4}) {
    RecognitionStep turned = plain;
    turned.symmetry = n;
    const Pose T = turned.T_robot_object();
    EXPECT_LE(std::abs(T.theta_rad), std::numbers::pi / n);
    // The middle of the object stays where it is, and so does the set of its turns.
    const glm::dvec2 middle = turned.body->centroid_mm;
    const Pose given = inverse(plain.pose());
    EXPECT_LT(glm::distance(T * middle, given * middle), 1e-9);
    EXPECT_NEAR(wrap_angle(T.theta_rad - given.theta_rad, 2.0 * std::numbers::pi / n), 0.0, 1e-9);
  }
}

TEST(LeastTurned, CarriesTheCovarianceAsTurningEverySampleDoes) {
  const std::optional<Body> body(Body{.centroid_mm = {3.0, -2.0}, .inertia_mm2 = 1.0});
  const RefinedPose refined{
      .T_object_robot = {{40.0, 10.0}, 2.5},
      .covariance = {0.04, 0.01, 0.002, 0.01, 0.09, 0.001, 0.002, 0.001, 0.01}};
  const RefinedPose turned = least_turned(body, 2, refined);
  const Pose turn = turned.T_object_robot * inverse(refined.T_object_robot);
  EXPECT_NEAR(std::abs(turn.theta_rad), std::numbers::pi, 1e-12);
  const auto coordinates = [](const Pose& pose) {
    return glm::dvec3(pose.translation_mm, pose.theta_rad);
  };
  // Differences of turned poses near the refined one, along each axis.
  constexpr double step = 1e-3;
  glm::dmat3 jacobian;  // by columns
  for (int axis = 0; axis < 3; ++axis) {
    glm::dvec3 near = coordinates(refined.T_object_robot);
    near[axis] += step;
    const Pose moved = least_turned(body, 2, Pose{glm::dvec2(near), near.z});
    jacobian[axis] = (coordinates(moved) - coordinates(turned.T_object_robot)) / step;
  }
  const glm::dmat3 expected =
      jacobian * glm::make_mat3(refined.covariance.data()) * glm::transpose(jacobian);
  for (int i = 0; i < 9; ++i) {
    EXPECT_NEAR(turned.covariance[i], expected[i / 3][i % 3], 1e-9) << i;
  }
}

TEST(TurnWarning, IsSilentWhereTheMapKnowsItsSymmetryOrHasNone) {
  for (const auto& [letter, symmetry] : {std::pair{"O", 0}, {"I", 2}, {"A", 1}}) {
    EXPECT_THAT(step_of(letter, symmetry, symmetry, 2.0).warnings, IsEmpty()) << letter;
  }
}

}  // namespace palpate::turn_warning_test
