#include <algorithm>

#include "io/file_parts.hpp"
#include "palpate/files.hpp"
#include "palpate/simulation.hpp"
#include "support/program.hpp"

namespace palpate::touches_test {

class TouchesCommand : public ProgramTest {
 protected:
  /// The frames of a simulated stream, which are in f.h5.
  Recording frames_of(const std::string& sensor, const std::string& flags = "") const {
    done("record -o f.h5 --sensor simulate:" + sensor + ",speed=max " + flags);
    return read_recording(folder_ / "f.h5");
  }
  /// What the command says of the frames; it writes the touches to t.h5.
  std::string said_of(const Recording& frames, const std::string& flags = "") const {
    write_recording(folder_ / "f.h5", frames);
    return done("touches f.h5 -o t.h5 " + flags);
  }
  Recording touches_in(const Recording& frames, const std::string& flags = "") const {
    said_of(frames, flags);
    return read_recording(folder_ / "t.h5");
  }
  void expect_no_touches(const Recording& frames, const std::vector<std::string>& named) const {
    write_recording(folder_ / "f.h5", frames);
    expect_refused("touches f.h5 -o u.h5", named);
  }
};

TEST_F(TouchesCommand, FindsTheTouchesThatWereMade) {
  const Recording r = touches_in(frames_of("O,touches=12,seed=8,object=random"));
  EXPECT_EQ(r.rows, "touches");
  ASSERT_EQ(r.size(), 12u);
  EXPECT_EQ(r.elements_mm, digitacts_array());
  EXPECT_EQ(r.object, "");
  EXPECT_EQ(r.truth.value().object, "O");
  EXPECT_TRUE(r.valid.empty());
  for (std::size_t i = 0; i < r.size(); ++i) {
    // The steady half second is in the middle of 0.4 to 0.9 s of every second, after one of them.
    EXPECT_NEAR(r.time_s[i] - r.time_s[0], static_cast<double>(i), 0.05);
  }
}

TEST_F(TouchesCommand, TouchesAtUnknownPosesAreKeptAtThePoseZero) {
  const Recording frames = frames_of("A,touches=3");
  const Recording posed = touches_in(frames);
  const Recording unposed = touches_in(frames, "--unposed");
  EXPECT_EQ(posed.object, "A");
  EXPECT_EQ(unposed.pressure, posed.pressure);
  ASSERT_EQ(unposed.size(), 3u);
  for (const Pose& pose : unposed.T_robot_sensor) {
    EXPECT_EQ(pose.translation_mm, glm::dvec2(0.0, 0.0));
    EXPECT_EQ(pose.theta_rad, 0.0);
  }
  EXPECT_EQ(remarks("map t.h5 -o t.map.h5"),
            "palpate: t.h5: all 3 touches are at one pose; if their poses are unknown, give "
            "--unposed\n");
}

TEST_F(TouchesCommand, StreamThatWasCutOffIsClosedForOthers) {
  const Recording whole = frames_of("A,touches=3");
  std::filesystem::copy(folder_ / "f.h5", folder_ / "cut.h5");
  leave_open(folder_ / "cut.h5");
  ASSERT_FALSE(read_recording(folder_ / "cut.h5").closed);
  // The touches are found where it cannot be closed: it is left as it is.
  std::filesystem::permissions(folder_ / "cut.h5", std::filesystem::perms::owner_read);
  const Outcome outcome = palpate("touches cut.h5 -o t.h5", {.obeys_permissions = true});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  expect_named(outcome.out, {"t.h5: 3 touches"});
  EXPECT_EQ(outcome.out.find("closed"), std::string::npos) << outcome.out;
  EXPECT_TRUE(outcome.err.starts_with("palpate: cut.h5: cannot be closed: ")) << outcome.err;
  EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
  EXPECT_EQ(read_recording(folder_ / "t.h5").size(), 3u);

  std::filesystem::permissions(folder_ / "cut.h5", std::filesystem::perms::owner_all);
  expect_named(done("touches cut.h5 -o t.h5"), {"3 touches", "cut.h5: was cut off"});
  EXPECT_TRUE(read_recording(folder_ / "cut.h5").closed);
  EXPECT_EQ(read_recording(folder_ / "cut.h5").size(), whole.size());
  const std::string before = bytes_of(folder_ / "cut.h5");
  EXPECT_EQ(done("touches cut.h5 -o t.h5").find("cut off"), std::string::npos);
  EXPECT_TRUE(bytes_of(folder_ / "cut.h5") == before);
}

TEST_F(TouchesCommand, DeadElementsUnitAndSensorAreCopied) {
  Recording frames = frames_of("A,touches=2");
  frames.pressure_unit = "raw";
  frames.serial = "17";
  frames.valid.assign(36, 1);
  frames.valid[5] = 0;
  expect_no_touches(frames, {"f.h5", "--onset"});
  const Recording r = touches_in(frames, "--onset 2");
  EXPECT_EQ(r.size(), 2u);
  EXPECT_EQ(r.pressure_unit, "raw");
  EXPECT_EQ(r.serial, "17");
  EXPECT_EQ(r.valid, frames.valid);
}

TEST_F(TouchesCommand, TouchesWithoutAPoseAreLeftOut) {
  Recording frames = frames_of("A,touches=3");
  // The first press begins at 1.3 s and ends at 2 s.
  std::fill_n(frames.T_robot_sensor.begin(), 200, unknown_pose);
  expect_named(said_of(frames), {"2 touches", "1 without a pose left out"});
  EXPECT_EQ(read_recording(folder_ / "t.h5").size(), 2u);
  frames.T_robot_sensor.assign(frames.size(), unknown_pose);
  expect_no_touches(frames, {"f.h5", "3 touches", "--poses"});
}

// The sensor reads about 3 kPa untouched, more than the onset.
TEST_F(TouchesCommand, TheRestIsFoundWithoutABaseline) {
  const Recording frames = frames_of("A,touches=3");
  const Recording tared = touches_in(frames);
  ASSERT_EQ(tared.size(), 3u);
  // With --drift-s 0, the baseline of the recording is all that is subtracted.
  EXPECT_EQ(touches_in(frames, "--drift-s 0").size(), 3u);
  EXPECT_EQ(touches_in(frames_of("A,touches=3", "--tare 0")).pressure, tared.pressure);
}

TEST_F(TouchesCommand, SaysWhatMayCostTouches) {
  const Recording frames = frames_of("A,touches=8");
  EXPECT_EQ(remarks("touches f.h5 -o t.h5"), "");
  expect_refused("touches f.h5 -o u.h5 --drift-s 0.3",
                 {"f.h5: ", "an element drifts by the onset", "--drift-s"});
  Recording falls = frames;
  for (double& reading : falls.pressure) {
    reading = -reading;
  }
  falls.baseline.clear();
  expect_no_touches(falls, {"f.h5: its readings fall in presses", "--sign -1"});
  Recording seldom = frames;
  std::ranges::for_each(seldom.time_s, [](double& time_s) { time_s *= 1000.0; });
  expect_no_touches(seldom, {"no two frames of a press lie less than 0.5 s apart"});
  Recording swapped = frames;
  for (std::size_t i = 0; i + 1 < frames.size(); i += 2) {
    std::swap(swapped.time_s[i], swapped.time_s[i + 1]);
  }
  expect_no_touches(swapped, {"time runs backwards at " + std::to_string(frames.size() / 2)});
}

TEST_F(TouchesCommand, RefusesWhatHoldsNoTouches) {
  touches_in(frames_of("A,touches=1"));
  expect_refused("touches t.h5 -o u.h5", {"t.h5", "touches"});
  expect_refused("touches missing.h5 -o u.h5", {"missing.h5"});
  for (const auto& [flags, named] : {std::pair{"--onset 1000", "--onset"},
                                     {"--onset=-1", "--onset -1"},
                                     {"--release 5", "release = 5"},
                                     {"--steady 2", "steady = 2"},
                                     {"--drift-s=-1", "--drift-s -1"}}) {
    expect_refused(std::string("touches f.h5 -o u.h5 ") + flags, {named});
  }
}

}  // namespace palpate::touches_test
