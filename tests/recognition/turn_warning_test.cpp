#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <glm/geometric.hpp>

#include "letters.hpp"
#include "palpate/rotational_symmetry.hpp"
#include "recognition/recognition_record.hpp"
#include "recognition/warnings.hpp"
#include "support/unknown_of.hpp"

namespace palpate::turn_warning_test {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST(MeasuredSymmetry, OfLearnedMapsIsTheShapes) {
  Device device = Device::open();
  // B, M, 8 and Q come close to a symmetry.
  for (const auto& [shape, n] : {std::pair{"A", 1},
                                 {"B", 1},
                                 {"E", 1},
                                 {"H", 2},
                                 {"I", 2},
                                 {"M", 1},
                                 {"O", 0},
                                 {"Q", 1},
                                 {"U", 1},
                                 {"X", 2},
                                 {"8", 1},
                                 {"ring", 0},
                                 {"bar", 2}}) {
    const auto measured = measure_symmetry(learned_map(device, shape, 1));
    ASSERT_TRUE(measured);
    EXPECT_EQ(measured->suggested, n) << shape;
  }
}

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

class TurnWarning : public testing::Test {
 protected:
  TurnWarning() : maps_(learned_letters(device_)) {}

  /// The step after 9 touches of a letter whose map suggests one symmetry and has another; the
  /// truth, if any, is turned so far.
  RecognitionStep step(const std::string& letter, int suggested, int symmetry,
                       std::optional<double> turn_rad) {
    for (Hypothesis& hypothesis : maps_) {
      if (hypothesis.map.label == letter) {
        hypothesis.map.suggested_symmetry = suggested;
        hypothesis.map.symmetry = symmetry;
      }
    }
    const Recording recording = letter_touches(letter, 9, 11);
    Query unknown = unknown_of(recording);
    if (turn_rad) {
      // Turned in the object frame, about the letter's middle.
      unknown.truth.T_object_robot = Pose{{}, *turn_rad} * *unknown.truth.T_object_robot;
    } else {
      unknown.truth = {};
    }
    const RecognitionTask task(maps_, HistogramOptions{});
    Recogniser recogniser(device_, task);
    const RecognitionRecord record = recognise(recogniser, task, unknown, false);
    EXPECT_EQ(task.labels[record.last().best], letter);
    return record.last();
  }
  std::vector<std::string> warnings(const std::string& letter, int suggested, int symmetry,
                                    std::optional<double> turn_rad) {
    return step(letter, suggested, symmetry, turn_rad).warnings;
  }

  Device device_ = Device::open();
  std::vector<Hypothesis> maps_;
};

TEST_F(TurnWarning, TurnsThatTouchesDoNotTellApartCountAsEqual) {
  const RecognitionStep o = step("O", 0, 1, 2.0);
  EXPECT_THAT(o.warnings, ElementsAre(AllOf(HasSubstr("O looks the same after any turn"),
                                            HasSubstr("they count as equal"),
                                            HasSubstr("`symmetry 0`"), HasSubstr("`symmetry 1`"))));
  EXPECT_EQ(o.symmetry, 0);
  EXPECT_LT(*o.error_mm, 1.0);
  EXPECT_LT(*o.refined_error_mm, 1.0);
  EXPECT_EQ(o.T_robot_object().theta_rad, 0.0);
  EXPECT_EQ(o.true_T_robot_object()->theta_rad, 0.0);
  const RecognitionStep i = step("I", 2, 1, {});
  EXPECT_THAT(i.warnings, ElementsAre(AllOf(HasSubstr("I looks the same after every 1/2 of a turn"),
                                            HasSubstr("`symmetry 2`"))));
  EXPECT_EQ(i.symmetry, 2);
}

TEST_F(TurnWarning, SaysThatAnErrorIsSuchATurn) {
  // Touches tell the turns of an A apart, whatever its map says.
  const RecognitionStep a = step("A", 2, 1, std::numbers::pi);
  EXPECT_EQ(a.symmetry, 1);
  EXPECT_THAT(a.warnings, ElementsAre(AllOf(HasSubstr("the pose error of "),
                                            HasSubstr(" mm where such turns do not count"))));
}

TEST_F(TurnWarning, ThetaOfSymmetricObjectsLiesWithinOneTurnOfThem) {
  const RecognitionStep plain = step("I", 2, 1, 0.0);
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
  // Differences of turned poses near the refined one, along each axis.
  constexpr double step = 1e-3;
  double jacobian[3][3];
  for (int axis = 0; axis < 3; ++axis) {
    Pose near = refined.T_object_robot;
    (axis == 0   ? near.translation_mm.x
     : axis == 1 ? near.translation_mm.y
                 : near.theta_rad) += step;
    const Pose moved = least_turned(body, 2, near);
    jacobian[0][axis] = (moved.translation_mm.x - turned.T_object_robot.translation_mm.x) / step;
    jacobian[1][axis] = (moved.translation_mm.y - turned.T_object_robot.translation_mm.y) / step;
    jacobian[2][axis] = (moved.theta_rad - turned.T_object_robot.theta_rad) / step;
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      double expected = 0.0;
      for (int k = 0; k < 3; ++k) {
        for (int l = 0; l < 3; ++l) {
          expected += jacobian[i][k] * refined.covariance[3 * k + l] * jacobian[j][l];
        }
      }
      EXPECT_NEAR(turned.covariance[3 * i + j], expected, 1e-9) << i << j;
    }
  }
}

TEST_F(TurnWarning, IsSilentWhereTheMapKnowsItsSymmetryOrHasNone) {
  EXPECT_THAT(warnings("O", 0, 0, 2.0), IsEmpty());
  EXPECT_THAT(warnings("I", 2, 2, 2.0), IsEmpty());
  EXPECT_THAT(warnings("A", 1, 1, 2.0), IsEmpty());
}

}  // namespace palpate::turn_warning_test
