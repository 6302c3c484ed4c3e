// What touches at known poses say about the set-up that they were taken with.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include <gmock/gmock.h>
#include <glm/geometric.hpp>

#include "learning/setup_check.hpp"
#include "palpate/simulation.hpp"
#include "support/errors.hpp"
#include "support/shared_device.hpp"

namespace palpate::setup_check_test {

using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;

using Recordings = std::vector<Recording>;

/// Touches each of two letters at random poses, or at random places and one angle.
Recordings touches(const std::vector<glm::dvec2>& elements_mm = digitacts_array(), int count = 40,
                   std::optional<double> theta_rad = {}) {
  Recordings recordings;
  std::uint64_t seed = 3;
  for (const char* letter : {"A", "E"}) {
    std::vector<Pose> poses = random_poses(count, ++seed);
    for (Pose& pose : poses) {
      pose.theta_rad = theta_rad.value_or(pose.theta_rad);
    }
    Simulator simulator(make_shape(letter), {}, elements_mm, seed);
    recordings.push_back(simulator.touch(poses, {}));
    recordings.back().path = std::string(letter) + ".h5";
  }
  return recordings;
}

/// The touches with poses that `change` gives.
template <class Change>
Recordings posed(Recordings recordings, const Change& change) {
  for (Recording& recording : recordings) {
    std::ranges::transform(recording.T_robot_sensor, recording.T_robot_sensor.begin(), change);
  }
  return recordings;
}

/// The touches of an array that is mounted at this pose of the recordings' array.
Recordings mounted_at(const Pose& offset, const Recordings& recordings) {
  return posed(recordings, [&](const Pose& pose) { return pose * inverse(offset); });
}

/// A recording's first touches.
Recording first_of(Recording recording, std::size_t count) {
  recording.T_robot_sensor.resize(count);
  recording.pressure.resize(count * recording.elements_mm.size());
  recording.time_s.resize(std::min(recording.time_s.size(), count));
  return recording;
}

SetupCheck check(const Recordings& recordings) {
  return check_setup(shared_device(), recordings, MapOptions());
}

bool order_is_suspected(const Recordings& recordings) {
  return suspected_order(shared_device(), recordings, MapOptions()).has_value();
}

/// The only finding, which is of this kind.
SetupFinding only_finding(const SetupCheck& found, const std::string& what) {
  EXPECT_THAT(found.findings, ElementsAre(Field(&SetupFinding::what, what)))
      << (found.findings.empty() ? "" : found.findings[0].words);
  return found.findings.empty() ? SetupFinding() : found.findings[0];
}

TEST(SetupCheck, FindsNothingWhereTheSetupIsSound) {
  for (const auto& elements_mm : {digitacts_array(), grid_array(4, 7, 2.2)}) {
    const SetupCheck found = check(touches(elements_mm));
    EXPECT_THAT(found.findings, IsEmpty());
    EXPECT_THAT(found.remarks, IsEmpty());
    EXPECT_EQ(found.elements_mm, elements_mm);
    EXPECT_GT(found.touches, 70u);
  }
}

TEST(SetupCheck, TellsTheOrderInWhichElementsAreRead) {
  Recordings recordings = touches(grid_array(4, 7, 2.2));
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
  const SetupFinding finding = only_finding(found, "element_order");
  EXPECT_THAT(finding.options, ElementsAre("first-element top-right", "order columns"));
  EXPECT_GT(finding.nats, 200.0);
  EXPECT_TRUE(order_is_suspected(recordings));
  for (Recording& recording : recordings) {
    recording.elements_mm = found.elements_mm;
  }
  EXPECT_FALSE(order_is_suspected(recordings)) << "as it corrects the array";
}

TEST(SetupCheck, TellsWhereTheArraySitsInTheToolHoweverFarOffAndTurned) {
  std::vector<glm::dvec2> beside = digitacts_array();  // its frame's origin
  for (glm::dvec2& p : beside) {
    p += glm::dvec2(7.0, -4.0);
  }
  for (const auto& [elements_mm, offset] : {std::pair{digitacts_array(), Pose{{2.1, -1.4}, 0.07}},
                                            {digitacts_array(), Pose{{0.0, 0.32}, -0.03}},
                                            {digitacts_array(), Pose{{-31.0, 47.0}, -2.6}},
                                            {beside, Pose{{-12.0, 9.0}, 1.2}}}) {
    const SetupCheck found = check(mounted_at(offset, touches(elements_mm)));
    const SetupFinding finding = only_finding(found, "array_offset");
    const Pose& told = finding.array_offset.value();
    const glm::dvec2 middle = array_centre_mm(elements_mm);
    const double within_mm = glm::length(offset.translation_mm) < 5.0 ? 0.2 : 0.5;
    EXPECT_LT(glm::distance(told * middle, offset * middle), within_mm);
    EXPECT_LT(std::abs(wrap_angle(told.theta_rad - offset.theta_rad)), std::numbers::pi / 180.0);
    EXPECT_LT(finding.sd->at(0), 0.2);
    EXPECT_EQ(found.elements_mm[0], told * elements_mm[0]);
  }
  EXPECT_THAT(check(mounted_at({{0.15, -0.12}, 0.0}, touches())).findings, IsEmpty())
      << "which unlike gains may feign";
}

TEST(SetupCheck, TellsAMirroredOrderOfAnArrayThatIsFarOff) {
  const Pose offset{{17.0, -24.0}, 1.0};
  Recordings recordings = mounted_at(offset, touches());
  for (Recording& recording : recordings) {
    for (glm::dvec2& p : recording.elements_mm) {
      p.x = -p.x;
    }
  }
  const SetupCheck found = check(recordings);
  EXPECT_THAT(found.findings, ElementsAre(Field(&SetupFinding::what, "element_order"),
                                          Field(&SetupFinding::what, "array_offset")));
  for (std::size_t e = 0; e < found.elements_mm.size(); ++e) {
    EXPECT_LT(glm::distance(found.elements_mm[e], offset * digitacts_array()[e]), 0.4);
  }
}

TEST(SetupCheck, GivesNoneForTouchesThatNoSetupExplains) {
  const Recordings sound = touches(digitacts_array(), 60);
  Recordings late = sound;
  for (Recording& recording : late) {
    std::ranges::rotate(recording.T_robot_sensor, recording.T_robot_sensor.begin() + 2);
  }
  Recordings two = sound;  // objects in each
  const std::size_t half = 30;
  for (std::size_t k = 0; k < 2; ++k) {
    const Recording& other = sound[1 - k];
    const auto n = static_cast<std::ptrdiff_t>(half * other.elements());
    std::ranges::copy_n(other.pressure.begin(), n, two[k].pressure.begin());
    std::ranges::copy_n(other.T_robot_sensor.begin(), half, two[k].T_robot_sensor.begin());
  }
  const Recordings metres = posed(sound, [](const Pose& pose) {
    return Pose{pose.translation_mm / 1000.0, 0.3};
  });
  for (const Recordings& recordings : {late, two, metres}) {
    const SetupCheck found = check(recordings);
    EXPECT_THAT(only_finding(found, "unexplained").options, IsEmpty());
    EXPECT_EQ(found.elements_mm, digitacts_array());
    EXPECT_GT(found.touches, 100u);
  }
}

TEST(SetupCheck, OfTouchesAtOneAngleTellsNothingOfTheArraysPlace) {
  const SetupCheck found =
      check(mounted_at({{2.0, -1.0}, 0.0}, touches(digitacts_array(), 40, 0.3)));
  EXPECT_THAT(found.findings, IsEmpty());
  EXPECT_THAT(found.remarks, ElementsAre(HasSubstr("all touches are at nearly one angle")));
}

TEST(SetupCheck, OfTouchesAtOnePlaceTellsNothingOfTheOrder) {
  Recordings recordings =
      posed(touches(grid_array(16, 16, 0.73)), [](const Pose&) { return Pose(); });
  for (Recording& recording : recordings) {
    for (glm::dvec2& p : recording.elements_mm) {
      p += glm::dvec2(0.13, -0.21);  // mirrored, it lies otherwise among the cells
    }
  }
  const SetupCheck found = check(recordings);
  EXPECT_THAT(found.findings, IsEmpty());
  EXPECT_THAT(found.remarks, ElementsAre(HasSubstr("at nearly one place and angle")));
  EXPECT_FALSE(order_is_suspected(recordings));
}

TEST(SetupCheck, TellsThePitchAndTheUnitsOfPoses) {
  constexpr double degrees = 180.0 / std::numbers::pi;
  Recordings recordings = posed(touches(), [](const Pose& pose) {
    return Pose{pose.translation_mm / 1000.0, pose.theta_rad * degrees};
  });
  for (Recording& recording : recordings) {
    for (glm::dvec2& p : recording.elements_mm) {
      p *= 0.8;
    }
  }
  const SetupCheck found = check(recordings);
  ASSERT_EQ(found.findings.size(), 2u);
  EXPECT_THAT(found.findings[0].options, ElementsAre("pose-unit m,deg"));
  EXPECT_EQ(found.findings[1].what, "pitch");
  EXPECT_NEAR(found.elements_mm[0].x, digitacts_array()[0].x, 0.15);
  // In radians, too, angles that count turns exceed a circle.
  const Recordings turns = posed(touches(), [i = 0](const Pose& pose) mutable {
    const double turned_rad = i++ % 2 == 0 ? 2.0 * std::numbers::pi : 0.0;
    return Pose{pose.translation_mm / 1000.0, pose.theta_rad + turned_rad};
  });
  EXPECT_THAT(only_finding(check(turns), "pose_unit").options, ElementsAre("pose-unit m,rad"));
}

TEST(SetupCheck, TellsDeadAndStuckElementsAndTouchesOfAnotherPlace) {
  Recordings recordings = touches(digitacts_array(), 60);
  for (Recording& recording : recordings) {
    for (std::size_t i = 0; i < recording.size(); ++i) {
      recording.pressure[36 * i + 14] = 0.0;
      recording.pressure[36 * i + 21] = 40.0;
    }
  }
  recordings[1].T_robot_sensor[7].translation_mm += glm::dvec2(9.0, 4.0);
  EXPECT_THAT(check(recordings).findings,
              ElementsAre(Field(&SetupFinding::options, ElementsAre("dead 14")),
                          Field(&SetupFinding::options, ElementsAre("dead 21")),
                          Field(&SetupFinding::words,
                                HasSubstr("E.h5: touches that contradict the others: 7;"))));
}

TEST(SetupCheck, BringsWhatTheLogsShowed) {
  Recordings recordings = touches();
  recordings[1].findings = {{"dropped", 0.0, "6 of 40 presses were left out"}};
  EXPECT_EQ(only_finding(check(recordings), "dropped").words,
            "E.h5: 6 of 40 presses were left out");
  const SetupCheck found = check({first_of(recordings[1], 3)});
  EXPECT_EQ(found.findings.size(), 1u) << "it may be why there are few touches";
  EXPECT_THAT(found.remarks, ElementsAre(HasSubstr("object 'E': 3 touches in contact")));
}

TEST(SetupCheck, RefusesTouchesThatCannotBeJudged) {
  const Recordings recordings = touches();
  const auto pressed = [&](double kPa) {
    Recording always = recordings[0];
    std::ranges::fill(always.pressure, kPa);
    return always;
  };
  const std::pair<const char*, Recordings> cases[] = {
      {"A.h5: its array is not that of all", {recordings[0], touches(grid_array(8, 8, 1.9))[0]}},
      {"object 'A': no element is in contact", {recordings[1], pressed(0.0)}},
      {"every element is in contact in every", {pressed(5.0)}},
      {"object 'A': 3 touches in contact", {first_of(recordings[0], 3), recordings[1]}}};
  for (const auto& [named, refused] : cases) {
    expect_named(input_error([&] { check(refused); }), {named});
  }
}

}  // namespace palpate::setup_check_test
