// What touches at known poses say about the set-up that they were taken with.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <gmock/gmock.h>
#include <glm/geometric.hpp>

#include "learning/setup_check.hpp"
#include "palpate/error.hpp"
#include "palpate/simulation.hpp"

namespace palpate::setup_check_test {

using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;

class SetupTouches : public testing::Test {
 protected:
  /// Touches each of two letters at random poses.
  static std::vector<Recording> touches(std::vector<glm::dvec2> elements_mm,
                                        bool at_one_angle = false, int count = 40) {
    std::vector<Recording> recordings;
    std::uint64_t seed = 3;
    for (const char* letter : {"A", "E"}) {
      std::vector<Pose> poses = random_poses(count, ++seed);
      for (Pose& pose : poses) {
        pose.theta_rad = at_one_angle ? 0.3 : pose.theta_rad;
      }
      Simulator simulator(make_shape(letter), {}, elements_mm, seed);
      recordings.push_back(simulator.touch(poses, {}));
      recordings.back().path = std::string(letter) + ".h5";
    }
    return recordings;
  }

  SetupCheck check(std::span<const Recording> recordings) {
    return check_setup(device_, recordings, MapOptions());
  }

  Device device_ = Device::open();
};

TEST_F(SetupTouches, FindNothingWhereTheSetupIsSound) {
  for (const auto& elements_mm : {digitacts_array(), grid_array(4, 7, 2.2)}) {
    const std::vector<Recording> recordings = touches(elements_mm);
    const SetupCheck found = check(recordings);
    EXPECT_THAT(found.findings, IsEmpty());
    EXPECT_THAT(found.remarks, IsEmpty());
    EXPECT_EQ(found.elements_mm, elements_mm);
    EXPECT_GT(found.touches, 70u);
  }
}

TEST_F(SetupTouches, TellTheOrderInWhichElementsAreRead) {
  std::vector<Recording> recordings = touches(grid_array(4, 7, 2.2));
  for (Recording& recording : recordings) {
    // Read by columns from the top right: reading k is of this element.
    const std::vector<double> truth = recording.pressure;
    for (std::size_t k = 0; k < truth.size(); ++k) {
      const std::size_t i = 3 - k % 28 / 7;
      const std::size_t j = 6 - k % 28 % 7;
      recording.pressure[k] = truth[k / 28 * 28 + 4 * j + i];
    }
  }
  const SetupCheck found = check(recordings);
  ASSERT_EQ(found.findings.size(), 1u);
  EXPECT_EQ(found.findings[0].what, "element_order");
  EXPECT_THAT(found.findings[0].options, ElementsAre("first-element top-right", "order columns"));
  EXPECT_GT(found.findings[0].nats, 200.0);
  for (Recording& recording : recordings) {
    recording.elements_mm = found.elements_mm;
  }
  EXPECT_FALSE(suspected_order(device_, recordings, MapOptions())) << "as it corrects the array";
}

TEST_F(SetupTouches, TellWhereTheArraySitsInTheTool) {
  // Each is the pose of the recordings' array in the true frame.
  for (const Pose& offset : {Pose{{2.1, -1.4}, 0.07}, Pose{{0.0, 0.32}, -0.03}}) {
    std::vector<Recording> recordings = touches(digitacts_array());
    for (Recording& recording : recordings) {
      for (Pose& pose : recording.T_robot_sensor) {
        pose = pose * inverse(offset);
      }
    }
    const SetupCheck found = check(recordings);
    ASSERT_EQ(found.findings.size(), 1u);
    const SetupFinding& finding = found.findings[0];
    EXPECT_EQ(finding.what, "array_offset");
    EXPECT_NEAR(finding.array_offset->translation_mm.x, offset.translation_mm.x, 0.2);
    EXPECT_NEAR(finding.array_offset->translation_mm.y, offset.translation_mm.y, 0.2);
    EXPECT_NEAR(finding.array_offset->theta_rad, offset.theta_rad, 0.02);
    EXPECT_LT(finding.sd->at(0), 0.2);
    EXPECT_EQ(found.elements_mm[0], *finding.array_offset * digitacts_array()[0]);
  }
}

TEST_F(SetupTouches, TellNoOffsetThatUnlikeGainsMayFeign) {
  const Pose offset{{0.15, -0.12}, 0.0};
  std::vector<Recording> recordings = touches(digitacts_array());
  for (Recording& recording : recordings) {
    for (Pose& pose : recording.T_robot_sensor) {
      pose = pose * inverse(offset);
    }
  }
  EXPECT_THAT(check(recordings).findings, IsEmpty());
}

TEST_F(SetupTouches, TellAMountThatIsFarOffAndTurned) {
  std::vector<glm::dvec2> beside = digitacts_array();  // its frame's origin
  for (glm::dvec2& p : beside) {
    p += glm::dvec2(7.0, -4.0);
  }
  struct Mount {
    std::vector<glm::dvec2> elements_mm;
    Pose offset;
    double within_mm;
  };
  const Mount mounts[] = {{digitacts_array(), {{-31.0, 47.0}, -2.6}, 0.3},
                          {grid_array(8, 8, 1.9), {{11.0, -10.0}, 0.4}, 0.3},
                          {beside, {{-12.0, 9.0}, 1.2}, 0.5}};
  for (const auto& [elements_mm, offset, within_mm] : mounts) {
    std::vector<Recording> recordings = touches(elements_mm, false, 60);
    for (Recording& recording : recordings) {
      for (Pose& pose : recording.T_robot_sensor) {
        pose = pose * inverse(offset);
      }
    }
    const SetupCheck found = check(recordings);
    ASSERT_EQ(found.findings.size(), 1u);
    ASSERT_EQ(found.findings[0].what, "array_offset") << found.findings[0].words;
    const Pose& told = *found.findings[0].array_offset;
    const glm::dvec2 middle = array_centre_mm(elements_mm);
    EXPECT_LT(glm::distance(told * middle, offset * middle), within_mm);
    EXPECT_LT(std::abs(wrap_angle(told.theta_rad - offset.theta_rad)), std::numbers::pi / 180.0);
  }
}

TEST_F(SetupTouches, TellAMirroredOrderOfAnArrayThatIsFarOff) {
  std::vector<Recording> recordings = touches(digitacts_array(), false, 60);
  const std::vector<glm::dvec2> truth = recordings[0].elements_mm;
  const Pose offset{{17.0, -24.0}, 1.0};
  for (Recording& recording : recordings) {
    for (Pose& pose : recording.T_robot_sensor) {
      pose = pose * inverse(offset);
    }
    for (glm::dvec2& p : recording.elements_mm) {
      p.x = -p.x;
    }
  }
  const SetupCheck found = check(recordings);
  EXPECT_THAT(found.findings, ElementsAre(Field(&SetupFinding::what, "element_order"),
                                          Field(&SetupFinding::what, "array_offset")));
  for (std::size_t e = 0; e < truth.size(); ++e) {
    EXPECT_LT(glm::distance(found.elements_mm[e], offset * truth[e]), 0.4);
  }
}

TEST_F(SetupTouches, ThatNoSetupExplainsAreGivenNone) {
  const std::vector<Recording> sound = touches(digitacts_array(), false, 60);
  const auto expect_unexplained = [&](const std::vector<Recording>& recordings) {
    const SetupCheck found = check(recordings);
    ASSERT_EQ(found.findings.size(), 1u);
    EXPECT_EQ(found.findings[0].what, "unexplained") << found.findings[0].words;
    EXPECT_THAT(found.findings[0].options, IsEmpty());
    EXPECT_EQ(found.elements_mm, sound[0].elements_mm);
    EXPECT_GT(found.touches, 100u);
  };
  std::vector<Recording> late = sound;
  for (Recording& recording : late) {
    std::ranges::rotate(recording.T_robot_sensor, recording.T_robot_sensor.begin() + 2);
  }
  expect_unexplained(late);
  std::vector<Recording> two = sound;  // objects in each
  const std::size_t half = 30;
  for (std::size_t k = 0; k < 2; ++k) {
    const Recording& other = sound[1 - k];
    const auto n = static_cast<std::ptrdiff_t>(half * other.elements());
    std::ranges::copy_n(other.pressure.begin(), n, two[k].pressure.begin());
    std::ranges::copy_n(other.T_robot_sensor.begin(), half, two[k].T_robot_sensor.begin());
  }
  expect_unexplained(two);
}

TEST_F(SetupTouches, AtOneAngleTellNothingOfTheArraysPlace) {
  std::vector<Recording> recordings = touches(digitacts_array(), true);
  for (Recording& recording : recordings) {
    for (Pose& pose : recording.T_robot_sensor) {
      pose = pose * Pose{{-2.0, 1.0}, 0.0};
    }
  }
  const SetupCheck found = check(recordings);
  EXPECT_THAT(found.findings, IsEmpty());
  EXPECT_THAT(found.remarks, ElementsAre(HasSubstr("all touches are at nearly one angle")));
}

TEST_F(SetupTouches, AtOnePlaceTellNothingOfTheOrder) {
  std::vector<Recording> recordings = touches(grid_array(16, 16, 0.73));
  for (Recording& recording : recordings) {
    for (Pose& pose : recording.T_robot_sensor) {
      pose = {};
    }
    for (glm::dvec2& p : recording.elements_mm) {
      p += glm::dvec2(0.13, -0.21);  // mirrored, it lies otherwise among the cells
    }
  }
  const SetupCheck found = check(recordings);
  EXPECT_THAT(found.findings, IsEmpty());
  EXPECT_THAT(found.remarks, ElementsAre(HasSubstr("at nearly one place and angle")));
  EXPECT_FALSE(suspected_order(device_, recordings, MapOptions()));
}

TEST_F(SetupTouches, TellThePitchAndTheUnitsOfPoses) {
  std::vector<Recording> recordings = touches(digitacts_array());
  for (Recording& recording : recordings) {
    for (Pose& pose : recording.T_robot_sensor) {
      pose = {pose.translation_mm / 1000.0, pose.theta_rad * 180.0 / std::numbers::pi};
    }
    for (glm::dvec2& p : recording.elements_mm) {
      p *= 0.8;
    }
  }
  const SetupCheck found = check(recordings);
  ASSERT_EQ(found.findings.size(), 2u);
  EXPECT_THAT(found.findings[0].options, ElementsAre("pose-unit m,deg"));
  EXPECT_EQ(found.findings[1].what, "pitch");
  EXPECT_NEAR(found.elements_mm[0].x, digitacts_array()[0].x, 0.15);
}

TEST_F(SetupTouches, TellMetresWhereAnglesInRadiansCountTurns) {
  std::vector<Recording> recordings = touches(digitacts_array());
  for (Recording& recording : recordings) {
    for (std::size_t i = 0; i < recording.size(); ++i) {
      Pose& pose = recording.T_robot_sensor[i];
      pose.translation_mm /= 1000.0;
      pose.theta_rad += i % 2 == 0 ? 2.0 * std::numbers::pi : 0.0;
    }
  }
  const SetupCheck found = check(recordings);
  ASSERT_EQ(found.findings.size(), 1u);
  EXPECT_THAT(found.findings[0].options, ElementsAre("pose-unit m,rad"));
}

TEST_F(SetupTouches, TellDeadAndStuckElementsAndTouchesOfAnotherPlace) {
  std::vector<Recording> recordings = touches(digitacts_array(), false, 60);
  for (Recording& recording : recordings) {
    for (std::size_t i = 0; i < recording.size(); ++i) {
      recording.pressure[36 * i + 14] = 0.0;
      recording.pressure[36 * i + 21] = 40.0;
    }
  }
  recordings[1].T_robot_sensor[7].translation_mm += glm::dvec2(9.0, 4.0);
  const SetupCheck found = check(recordings);
  EXPECT_THAT(found.findings,
              ElementsAre(Field(&SetupFinding::options, ElementsAre("dead 14")),
                          Field(&SetupFinding::options, ElementsAre("dead 21")),
                          Field(&SetupFinding::words,
                                HasSubstr("E.h5: touches that contradict the others: 7;"))));
}

TEST_F(SetupTouches, BringWhatTheirLogsShowed) {
  std::vector<Recording> recordings = touches(digitacts_array());
  recordings[1].findings = {{"dropped", 0.0, "6 of 40 presses were left out"}};
  EXPECT_THAT(check(recordings).findings,
              ElementsAre(Field(&SetupFinding::words, "E.h5: 6 of 40 presses were left out")));
  Recording few = recordings[1];
  few.T_robot_sensor.resize(3);
  few.pressure.resize(3 * few.elements_mm.size());
  const SetupCheck found = check({&few, 1});
  EXPECT_EQ(found.findings.size(), 1u) << "it may be why there are few touches";
  EXPECT_THAT(found.remarks, ElementsAre(HasSubstr("object 'E': 3 touches in contact")));
}

TEST_F(SetupTouches, AreRefusedWhereTheyCannotBeJudged) {
  std::vector<Recording> recordings = touches(digitacts_array());
  Recording other = touches(grid_array(8, 8, 1.9))[0];
  EXPECT_THAT(
      [&] {
        check(std::vector{recordings[0], other});
      },
      testing::ThrowsMessage<Error>(HasSubstr("A.h5: its array is not that of all")));
  const auto with_pressure = [&](double kPa) {
    Recording always = touches(digitacts_array())[0];
    std::ranges::fill(always.pressure, kPa);
    return always;
  };
  EXPECT_THAT(
      [&] {
        check(std::vector{recordings[1], with_pressure(0.0)});
      },
      testing::ThrowsMessage<Error>(HasSubstr("object 'A': no element is in contact")));
  EXPECT_THAT([&] { check(std::vector{with_pressure(5.0)}); },
              testing::ThrowsMessage<Error>(HasSubstr("every element is in contact in every")));
  Recording& few = recordings[0];
  few.T_robot_sensor.resize(3);
  few.pressure.resize(3 * 36);
  few.time_s.resize(std::min<std::size_t>(few.time_s.size(), 3));
  EXPECT_THAT([&] { check(recordings); },
              testing::ThrowsMessage<Error>(HasSubstr("object 'A': 3 touches in contact")));
}

}  // namespace palpate::setup_check_test
