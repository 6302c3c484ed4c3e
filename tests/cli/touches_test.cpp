#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "palpate/files.hpp"
#include "palpate/frame_recorder.hpp"
#include "palpate/simulation.hpp"
#include "support/program.hpp"

namespace palpate::touches_test {

using nlohmann::json;

class TouchesCommand : public ProgramTest {
 protected:
  // The touches of a simulated stream, by way of a file of frames.
  Recording touches_of(const std::string& name, const std::string& sensor) const {
    done({"record", "--sensor", sensor + ",speed=max", "-o", name + ".frames.h5"});
    done({"touches", name + ".frames.h5", "-o", name + ".h5"});
    return read_recording(folder_ / (name + ".h5"));
  }

  static double mean(const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  }

  // The frames of three touches: whole.h5, and cut.h5, whose recorder was killed.
  void cut_off() const {
    done({"record", "--sensor", "simulate:A,touches=3,speed=max", "-o", "whole.h5"});
    const Recording whole = read_recording(folder_ / "whole.h5");
    const pid_t pid = ::fork();
    if (pid == 0) {
      FrameRecorder recorder(folder_ / "cut.h5",
                             {.elements_mm = whole.elements_mm, .baseline = whole.baseline});
      for (std::size_t i = 0; i < whole.size(); ++i) {
        const Touch row = whole.touch(i);
        recorder.add({.host_time_s = whole.time_s[i],
                      .values = {row.pressure.begin(), row.pressure.end()},
                      .T_robot_sensor = row.T_robot_sensor});
      }
      recorder.flush();
      ::_exit(0);  // as a kill: nothing is closed
    }
    int status = -1;
    ::waitpid(pid, &status, 0);
    ASSERT_EQ(status, 0);
    ASSERT_FALSE(read_recording(folder_ / "cut.h5").closed);
  }
};

TEST_F(TouchesCommand, FindsTheTouchesThatWereMade) {
  const Recording r = touches_of("u", "simulate:O,touches=12,seed=8,object=random");
  EXPECT_EQ(r.rows, "touches");
  ASSERT_EQ(r.size(), 12u);
  EXPECT_EQ(r.elements(), 36u);
  EXPECT_EQ(r.elements_mm, digitacts_array());
  EXPECT_EQ(r.object, "");
  ASSERT_TRUE(r.truth);
  EXPECT_EQ(r.truth->object, "O");
  for (std::size_t i = 0; i < r.size(); ++i) {
    // The steady half second is in the middle of 0.4 to 0.9 s of every second, after one of them.
    EXPECT_NEAR(r.time_s[i] - r.time_s[0], static_cast<double>(i), 0.05);
  }
}

TEST_F(TouchesCommand, TouchesAtUnknownPosesAreKeptAtThePoseZero) {
  const Recording posed = touches_of("a", "simulate:A,touches=3");
  done({"touches", "a.frames.h5", "-o", "b.h5", "--unposed"});
  const Recording unposed = read_recording(folder_ / "b.h5");
  EXPECT_EQ(unposed.pressure, posed.pressure);
  ASSERT_EQ(unposed.size(), 3u);
  for (const Pose& pose : unposed.T_robot_sensor) {
    EXPECT_EQ(pose.translation_mm, glm::dvec2(0.0, 0.0));
    EXPECT_EQ(pose.theta_rad, 0.0);
  }
  const Outcome blurred = palpate({"map", "b.h5", "-o", "b.map.h5"});
  EXPECT_EQ(blurred.status, 0);
  EXPECT_EQ(blurred.err,
            "palpate: b.h5: all 3 touches are at one pose; if their poses are unknown, give "
            "--unposed\n");
}

TEST_F(TouchesCommand, LettersAreRecognisedByWhatTheyFound) {
  for (const std::string letter : {"A", "E"}) {
    EXPECT_EQ(touches_of(letter, "simulate:" + letter + ",touches=60").object, letter);
  }
  done({"map", "A.h5", "E.h5", "-o", "maps/", "--sensor-model", "none"});
  std::vector<std::string> arguments;
  for (const std::string letter : {"A", "E"}) {
    touches_of("u" + letter, "simulate:" + letter + ",touches=10,seed=77,object=random");
    arguments.push_back("u" + letter + ".h5");
  }
  arguments.insert(arguments.end(), {"--maps", "maps"});
  for (const json& record : records(arguments)) {
    EXPECT_TRUE(record.at("right").get<bool>()) << record.dump(1);
    // Half a bin of 0.8 mm and of 22.5 degrees, at an arm of 8 mm.
    EXPECT_LT(record.at("error_mm").get<double>(), 2.0);
  }
}

TEST_F(TouchesCommand, StreamThatWasCutOffIsClosedForOthers) {
  cut_off();
  expect_named(done({"touches", "cut.h5", "-o", "t.h5"}), {"3 touches", "cut.h5: was cut off"});
  EXPECT_TRUE(read_recording(folder_ / "cut.h5").closed);
  EXPECT_EQ(read_recording(folder_ / "cut.h5").size(), read_recording(folder_ / "whole.h5").size());
  const std::string before = bytes_of(folder_ / "cut.h5");
  EXPECT_EQ(done({"touches", "cut.h5", "-o", "t.h5"}).find("cut off"), std::string::npos);
  EXPECT_TRUE(bytes_of(folder_ / "cut.h5") == before);
}

// The touches are found: what cannot be closed is left as it is.
TEST_F(TouchesCommand, StreamThatCannotBeClosedIsALineOfItsOwn) {
  cut_off();
  std::filesystem::permissions(folder_ / "cut.h5", std::filesystem::perms::owner_read);
  const Outcome outcome = palpate({"touches", "cut.h5", "-o", "t.h5"}, {.obeys_permissions = true});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  expect_named(outcome.out, {"t.h5: 3 touches"});
  EXPECT_EQ(outcome.out.find("closed"), std::string::npos) << outcome.out;
  EXPECT_TRUE(outcome.err.starts_with("palpate: cut.h5: cannot be closed: ")) << outcome.err;
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  EXPECT_EQ(read_recording(folder_ / "t.h5").size(), 3u);
}

TEST_F(TouchesCommand, DeadElementsUnitAndSensorAreCopied) {
  touches_of("a", "simulate:A,touches=2");
  Recording frames = read_recording(folder_ / "a.frames.h5");
  frames.pressure_unit = "raw";
  frames.serial = "17";
  frames.valid.assign(36, 1);
  frames.valid[5] = 0;
  write_recording(folder_ / "raw.h5", frames);
  expect_refused({"touches", "raw.h5", "-o", "t.h5"}, {"raw.h5", "--onset"});
  done({"touches", "raw.h5", "-o", "t.h5", "--onset", "2"});
  const Recording r = read_recording(folder_ / "t.h5");
  EXPECT_EQ(r.size(), 2u);
  EXPECT_EQ(r.pressure_unit, "raw");
  EXPECT_EQ(r.serial, "17");
  EXPECT_EQ(r.valid, frames.valid);
}

TEST_F(TouchesCommand, AnElementThatIsUnknownInATouchIsNotValidInIt) {
  const Recording all = touches_of("a", "simulate:A,touches=3");
  EXPECT_TRUE(all.valid.empty());
  Recording frames = read_recording(folder_ / "a.frames.h5");
  for (std::size_t i = 210; i < 310; ++i) {  // the second press lasts from 2.3 to 3 s
    frames.pressure[36 * i + 5] = std::nan("");
  }
  frames.pressure[36 * 50 + 7] = std::nan("");
  write_recording(folder_ / "b.h5", frames);
  expect_named(done({"touches", "b.h5", "-o", "t.h5"}), {"3 touches", "101 readings unknown"});
  const Recording r = read_recording(folder_ / "t.h5");
  ASSERT_EQ(r.size(), 3u);
  ASSERT_EQ(r.valid.size(), 3u * 36u);
  for (std::size_t k = 0; k < r.valid.size(); ++k) {
    EXPECT_EQ(r.valid[k], k == 36 + 5 ? 0 : 1) << k;
    if (k != 36 + 5) {
      // Where element 5 is unknown, its rest is held, which may move the ends of what counts as
      // untouched. Five times the noise of a rest, 0.1, for the element itself.
      EXPECT_NEAR(r.pressure[k], all.pressure[k], k % 36 == 5 ? 0.5 : 0.25) << k;
    }
  }
  EXPECT_EQ(r.pressure[36 + 5], 0.0);
  done({"map", "t.h5", "-o", "t.map.h5"});
}

TEST_F(TouchesCommand, TouchesWithoutAPoseAreLeftOut) {
  touches_of("a", "simulate:A,touches=3");
  Recording frames = read_recording(folder_ / "a.frames.h5");
  const Pose unknown{{std::nan(""), std::nan("")}, std::nan("")};
  for (std::size_t i = 0; i < 200; ++i) {  // the first press begins at 1.3 s and ends at 2 s
    frames.T_robot_sensor[i] = unknown;
  }
  write_recording(folder_ / "b.h5", frames);
  expect_named(done({"touches", "b.h5", "-o", "t.h5"}), {"2 touches", "1 without a pose left out"});
  EXPECT_EQ(read_recording(folder_ / "t.h5").size(), 2u);
  frames.T_robot_sensor.assign(frames.size(), unknown);
  write_recording(folder_ / "b.h5", frames);
  expect_refused({"touches", "b.h5", "-o", "u.h5"}, {"b.h5", "3 touches", "--poses"});
}

// The sensor reads about 3 kPa untouched, more than the onset.
TEST_F(TouchesCommand, TheRestIsFoundWithoutABaseline) {
  const std::string sensor = "simulate:A,touches=3,speed=max";
  done({"record", "--sensor", sensor, "-o", "tared.h5"});
  done({"record", "--sensor", sensor, "-o", "untared.h5", "--tare", "0"});
  done({"touches", "tared.h5", "-o", "tared.touches.h5"});
  done({"touches", "untared.h5", "-o", "untared.touches.h5"});
  const Recording tared = read_recording(folder_ / "tared.touches.h5");
  ASSERT_EQ(tared.size(), 3u);
  EXPECT_EQ(read_recording(folder_ / "untared.touches.h5").pressure, tared.pressure);

  // With --drift-s 0, the baseline of the recording is all that is subtracted.
  done({"touches", "tared.h5", "-o", "fixed.h5", "--drift-s", "0"});
  const Recording fixed = read_recording(folder_ / "fixed.h5");
  ASSERT_EQ(fixed.size(), 3u);
  // Both know the rest by the noise of half a second, 0.7 kPa of 100 Hz, in 36 elements.
  EXPECT_NEAR(mean(fixed.pressure), mean(tared.pressure), 0.15);
}

// The stream is cut where the first press is under way: what follows tells the rest.
TEST_F(TouchesCommand, AStreamMayBeginInATouch) {
  done({"record", "--sensor", "simulate:A,touches=1,speed=max", "-o", "f.h5"});
  Recording frames = read_recording(folder_ / "f.h5");
  const auto begin = static_cast<std::ptrdiff_t>(150);  // the press is steady from 1.4 to 1.9 s
  frames.pressure.erase(frames.pressure.begin(), frames.pressure.begin() + 36 * begin);
  frames.T_robot_sensor.erase(frames.T_robot_sensor.begin(), frames.T_robot_sensor.begin() + begin);
  frames.time_s.erase(frames.time_s.begin(), frames.time_s.begin() + begin);
  frames.lost_before.clear();
  frames.device_time_s.clear();
  write_recording(folder_ / "cut.h5", frames);
  expect_named(done({"touches", "cut.h5", "-o", "t.h5"}), {"1 touches"});
}

TEST_F(TouchesCommand, ElementsThatStickCostNoTouch) {
  done({"record", "--sensor", "simulate:A,touches=3,speed=max", "-o", "f.h5"});
  Recording frames = read_recording(folder_ / "f.h5");
  for (const std::size_t first : {std::size_t{0}, std::size_t{215}}) {
    for (std::size_t i = first; i < frames.size(); ++i) {
      frames.pressure[36 * i + 4] = 9.0;
      frames.pressure[36 * i + 31] = 9.0;
    }
    write_recording(folder_ / "stuck.h5", frames);
    expect_named(done({"touches", "stuck.h5", "-o", "t.h5"}), {"3 touches"});
  }
}

TEST_F(TouchesCommand, SaysThatAPressIsLongerThanTheWindow) {
  done({"record", "--sensor", "simulate:A,touches=8,speed=max", "-o", "f.h5"});
  const Outcome outcome = palpate({"touches", "f.h5", "-o", "t.h5", "--drift-s", "0.3"});
  expect_named(outcome.err, {"f.h5: ", "an element reads more by the onset", "--drift-s"});
  EXPECT_EQ(palpate({"touches", "f.h5", "-o", "t.h5"}).err, "");
}

TEST_F(TouchesCommand, SaysThatReadingsFallInPresses) {
  done({"record", "--sensor", "simulate:A,touches=6,speed=max", "-o", "f.h5"});
  Recording frames = read_recording(folder_ / "f.h5");
  for (double& reading : frames.pressure) {
    reading = -reading;
  }
  frames.baseline.clear();
  write_recording(folder_ / "falls.h5", frames);
  expect_refused({"touches", "falls.h5", "-o", "t.h5"},
                 {"falls.h5: its readings fall in presses", "--sign -1"});
}

TEST_F(TouchesCommand, SaysThatTimeRunsBackwards) {
  done({"record", "--sensor", "simulate:A,touches=2,speed=max", "-o", "f.h5"});
  Recording frames = read_recording(folder_ / "f.h5");
  for (std::size_t i = 0; i + 1 < frames.size(); i += 2) {
    std::swap(frames.time_s[i], frames.time_s[i + 1]);
  }
  const std::size_t backwards = frames.size() / 2;
  write_recording(folder_ / "swapped.h5", frames);
  expect_refused({"touches", "swapped.h5", "-o", "t.h5"},
                 {"time runs backwards at " + std::to_string(backwards) + " of its"});
}

TEST_F(TouchesCommand, RefusesWhatHoldsNoTouches) {
  touches_of("a", "simulate:A,touches=1");
  expect_refused({"touches", "a.h5", "-o", "t.h5"}, {"a.h5", "touches"});
  expect_refused({"touches", "a.frames.h5", "-o", "t.h5", "--onset", "1000"}, {"--onset"});
  expect_refused({"touches", "a.frames.h5", "-o", "t.h5", "--onset=-1"}, {"onset = -1"});
  expect_refused({"touches", "a.frames.h5", "-o", "t.h5", "--release", "5"}, {"release = 5"});
  expect_refused({"touches", "a.frames.h5", "-o", "t.h5", "--steady", "2"}, {"steady = 2"});
  expect_refused({"touches", "a.frames.h5", "-o", "t.h5", "--drift-s=-1"}, {"--drift-s -1"});
  expect_refused({"touches", "a.frames.h5", "-o", "a.frames.h5"},
                 {"-o a.frames.h5", "FRAMES reads"});
  expect_refused({"touches", "missing.h5", "-o", "t.h5"}, {"missing.h5"});
}

}  // namespace palpate::touches_test
