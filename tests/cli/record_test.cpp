#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <random>
#include <thread>

#include "palpate/files.hpp"
#include "support/program.hpp"

namespace palpate::record_test {

using namespace std::chrono_literals;

class RecordCommand : public ProgramTest {
 protected:
  Recording recorded(const std::string& file, std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"record", "-o", file});
    EXPECT_NE(done(arguments).find(file + ": "), std::string::npos);
    return read_recording(folder_ / file);
  }

  // The program while it records, its output in "said".
  pid_t start(const std::string& file, const std::string& sensor,
              const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments{"record", "--sensor", sensor, "-o", file};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return ProgramTest::start(arguments);
  }

  static int end(pid_t pid, int signal) {
    ::kill(pid, signal);
    int status = 0;
    ::waitpid(pid, &status, 0);
    return status;
  }

  // Waits for the recording, unless the program ends first.
  bool appears(const std::string& file, pid_t pid) const {
    while (!std::filesystem::exists(folder_ / file)) {
      if (::waitpid(pid, nullptr, WNOHANG) != 0) {
        return false;
      }
      std::this_thread::sleep_for(5ms);
    }
    return true;
  }
};

TEST_F(RecordCommand, KeepsAllThatTheSensorSays) {
  const Recording r =
      recorded("s.h5", {"--sensor", "simulate:E,touches=2,object=3:-4:30,speed=max"});
  EXPECT_EQ(r.rows, "frames");
  EXPECT_EQ(r.size(), 361u);  // 1 s, 2 presses, 0.6 s, both ends
  EXPECT_EQ(r.elements(), 36u);
  EXPECT_TRUE(r.closed);
  EXPECT_EQ(r.lost_before, std::vector<std::uint64_t>(361, 0));
  ASSERT_TRUE(r.truth);
  EXPECT_EQ(r.truth->object, "E");
  ASSERT_EQ(r.baseline.size(), 36u);
  for (std::size_t k = 0; k < 36; ++k) {
    std::vector<double> tare;
    for (std::size_t i = 0; i < r.size() && r.time_s[i] <= r.time_s[0] + 0.5; ++i) {
      tare.push_back(r.pressure[36 * i + k]);
    }
    ASSERT_EQ(tare.size(), 51u);
    std::nth_element(tare.begin(), tare.begin() + 25, tare.end());
    // Pressures are stored as float32, to 2.4e-7 of numbers below 8.
    EXPECT_NEAR(r.baseline[k], tare[25], 2.4e-7) << k;
  }
  for (const Pose& pose : r.T_robot_sensor) {
    EXPECT_TRUE(std::isfinite(pose.theta_rad));
  }
}

TEST_F(RecordCommand, SummaryAndInfoSayWhatThereIs) {
  expect_named(done({"record", "--sensor", "simulate:A,speed=max", "-o", "s.h5", "--seconds", "4",
                     "--object", "letter"}),
               {"s.h5: 400 frames in 3.990 s, 100.0 Hz, 0 lost, 400 with a pose"});
  expect_named(done({"info", "s.h5"}),
               {"recording of letter", "frames           400", "rate              100.0 Hz",
                "lost              0", "baseline          ", "closed            yes",
                "simulated DigiTacts"});
}

TEST_F(RecordCommand, ReplayIsTheRecordingAgain) {
  const Recording first = recorded("a.h5", {"--sensor", "simulate:A,touches=1,speed=max"});
  const Recording again = recorded("b.h5", {"--sensor", "replay:a.h5,speed=max"});
  EXPECT_EQ(again.pressure, first.pressure);
  EXPECT_EQ(again.time_s, first.time_s);
  EXPECT_EQ(again.baseline, first.baseline);
  EXPECT_EQ(again.object, "A");
}

TEST_F(RecordCommand, PosesComeFromAFile) {
  std::string poses;
  const Recording first = recorded("a.h5", {"--sensor", "simulate:A,touches=1,speed=max"});
  for (int i = 0; i <= 20; ++i) {
    poses += fmt::format(R"({{"time": {:.3f}, "x_mm": {}, "y_mm": 2, "theta_rad": 1}})"
                         "\n",
                         first.time_s[0] - 0.025 + 0.05 * i, i);
  }
  put_bytes(folder_ / "poses", poses);
  const Recording posed =
      recorded("b.h5", {"--sensor", "replay:a.h5,speed=max", "--poses", "poses"});
  EXPECT_NEAR(posed.T_robot_sensor[0].translation_mm.x, 0.5, 0.03);  // times rounded to 1 ms
  EXPECT_NEAR(posed.T_robot_sensor[50].translation_mm.x, 10.5, 0.03);
  EXPECT_TRUE(std::isnan(posed.T_robot_sensor[200].theta_rad)) << "the poses have ended";
  put_bytes(folder_ / "poses", poses + "nonsense\n");
  expect_refused({"record", "--sensor", "replay:a.h5,speed=max", "--poses", "poses", "-o", "c.h5"},
                 {"poses, line 22", "JSON"});
}

TEST_F(RecordCommand, LabelThatNoFileMayHoldIsRefusedAtOnce) {
  // A sensor that would be refused as well: it has not been opened yet.
  for (const char* label : {"caf\xe9", "a\nb"}) {
    expect_refused({"record", "--sensor", "replay:none.h5", "--object", label, "-o", "s.h5"},
                   {"--object", "UTF-8"});
  }
}

TEST_F(RecordCommand, PosesBeyondAllNumbersAreRefusedWithTheirLine) {
  recorded("a.h5", {"--sensor", "simulate:A,touches=1,speed=max"});
  std::string poses;
  for (int i = 1; i <= 20; ++i) {
    const std::string x = i == 4 ? "1.7e308" : i == 5 ? "-1.7e308" : "1";
    poses += fmt::format(R"({{"time": {}, "x_mm": {}, "y_mm": 2, "theta_rad": 1}})"
                         "\n",
                         0.05 * i, x);
  }
  put_bytes(folder_ / "poses", poses);
  expect_refused({"record", "--sensor", "replay:a.h5,speed=max", "--poses", "poses", "-o", "b.h5"},
                 {"poses, line 4", "x_mm = 1.7e+308", "1e9 mm"});
}

TEST_F(RecordCommand, CtrlCEndsItCleanly) {
  const pid_t pid = start("s.h5", "simulate:A,rate=500");
  ASSERT_TRUE(appears("s.h5", pid));
  expect_named(done({"info", "s.h5"}), {"closed            no: it is being recorded"});
  expect_named(palpate({"info", "--close", "s.h5"}).err, {"s.h5", "wait until it is done"});
  const int status = end(pid, SIGINT);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << bytes_of(folder_ / "complained");
  expect_named(bytes_of(folder_ / "said"), {"s.h5: ", " frames in ", " 0 lost"});
  EXPECT_TRUE(read_recording(folder_ / "s.h5").closed);
}

TEST_F(RecordCommand, KilledItLeavesAReadableFile) {
  std::mt19937_64 random(3);
  for (int run = 0; run < 3; ++run) {
    const std::string file = fmt::format("{}.h5", run);
    const pid_t pid = start(file, "simulate:A,rate=1000,speed=5");
    ASSERT_TRUE(appears(file, pid));
    std::this_thread::sleep_for(std::chrono::milliseconds(random() % 300));
    kill_program(pid);
    const Recording r = read_recording(folder_ / file);
    EXPECT_GT(r.size(), 0u);  // how many it appears with is the clock's matter
    for (std::size_t i = 1; i < r.size(); ++i) {
      ASSERT_NEAR(r.time_s[i] - r.time_s[i - 1], 0.001, 1e-6);  // none is missing
    }
    EXPECT_EQ(palpate({"touches", file, "-o", "t.h5", "--onset", "1000"}).status, 2);
    expect_named(done({"info", file}), {"closed            no: it was cut off", "info --close"});
    expect_named(done({"info", "--close", file}), {"closed            yes"});
    EXPECT_EQ(read_recording(folder_ / file).size(), r.size());
    EXPECT_TRUE(read_recording(folder_ / file).closed);
  }
}

TEST_F(RecordCommand, FullDiskIsOneLineAndLeavesAReadableFile) {
  // Less than the first rows take, and more.
  for (const rlim_t bytes : {2048, 400000, 900000}) {
    const Outcome outcome =
        palpate({"record", "--sensor", "simulate:A,touches=100,speed=max", "-o", "s.h5"},
                {.largest_file_bytes = bytes});
    EXPECT_EQ(outcome.status, 1) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    expect_named(outcome.err, {"s.h5", "File too large"});
    if (bytes > 2048) {
      EXPECT_GT(read_recording(folder_ / "s.h5").size(), 100u);
    } else {
      EXPECT_TRUE(content_of(folder_.path()).empty());
    }
  }
}

TEST_F(RecordCommand, TouchedWhileTheBaselineIsTakenIsRefused) {
  // The simulated robot begins its first press after 1.3 s.
  expect_refused(
      {"record", "--sensor", "simulate:A,touches=1,speed=max", "-o", "s.h5", "--tare", "1.6"},
      {"touched", "element"});
  const Recording r =
      recorded("s.h5", {"--sensor", "simulate:A,touches=1,speed=max", "--tare", "0"});
  EXPECT_TRUE(r.baseline.empty());
}

// What was recorded before stays until the tare is known to be good.
TEST_F(RecordCommand, ATouchedTareLeavesWhatWasThere) {
  recorded("s.h5", {"--sensor", "simulate:E,touches=1,speed=max"});
  expect_refused(
      {"record", "--sensor", "simulate:A,touches=1,speed=max", "-o", "s.h5", "--tare", "1.6"},
      {"touched", "element"});
  EXPECT_EQ(read_recording(folder_ / "s.h5").object, "E");
  EXPECT_EQ(recorded("s.h5", {"--sensor", "simulate:A,touches=1,speed=max"}).object, "A");
  EXPECT_EQ(content_of(folder_.path()).size(), 1u);
}

// No frame of an array that is connected to nothing is saved before the tare ends.
TEST_F(RecordCommand, FramesWithoutAKnownReadingAreNoRecording) {
  Recording frames = recorded("a.h5", {"--sensor", "simulate:A,touches=1,speed=max"});
  recorded("s.h5", {"--sensor", "simulate:E,touches=1,speed=max"});
  std::fill(frames.pressure.begin(), frames.pressure.end(), std::nan(""));
  write_recording(folder_ / "known.h5", frames);
  frames.baseline.clear();
  write_recording(folder_ / "unknown.h5", frames);
  const std::string of_all = fmt::format("{} frames", frames.size());
  for (const char* sensor : {"replay:known.h5,speed=max", "replay:unknown.h5,speed=max"}) {
    for (const char* tare : {"0", "0.5", "60"}) {
      for (const char* file : {"s.h5", "new.h5"}) {
        expect_refused({"record", "--sensor", sensor, "-o", file, "--tare", tare}, {"read"});
      }
    }
    expect_refused({"record", "--sensor", sensor, "-o", "new.h5", "--tare", "0"},
                   {sensor, of_all, "known reading", "palpate sensors"});
  }
}

// An element without a known reading in the tare, before anything of it is saved and afterwards.
TEST_F(RecordCommand, ATareWithoutAReadingOfAnElementLeavesWhatWasThere) {
  Recording frames = recorded("a.h5", {"--sensor", "simulate:A,touches=1,speed=max"});
  recorded("s.h5", {"--sensor", "simulate:E,touches=1,speed=max"});
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames.pressure[36 * i + 7] = std::nan("");
  }
  frames.baseline.clear();
  write_recording(folder_ / "unknown.h5", frames);
  for (const char* tare : {"0.1", "1"}) {
    for (const char* file : {"s.h5", "new.h5"}) {
      expect_refused(
          {"record", "--sensor", "replay:unknown.h5,speed=max", "-o", file, "--tare", tare},
          {"element 7", "mark it dead"});
    }
  }
}

TEST_F(RecordCommand, KilledDuringTheTareItLeavesWhatWasThere) {
  recorded("s.h5", {"--sensor", "simulate:E,touches=1,speed=max"});
  const auto before = content_of(folder_.path());
  const pid_t pid = start("s.h5", "simulate:A,rate=1000,speed=10", {"--tare", "1000"});
  ::usleep(300'000);
  kill_program(pid);
  EXPECT_EQ(content_of(folder_.path()).at("s.h5"), before.at("s.h5"));
}

TEST_F(RecordCommand, AFloodWithoutAnEndIsRefused) {
  for (const char* flood : {"speed=max", "speed=1e6", "rate=1000,speed=101", "rate=100000",
                            "rate=1000,array=64:64:1"}) {
    expect_refused({"record", "--sensor", fmt::format("simulate:A,{}", flood), "-o", "s.h5"},
                   {"simulate:A", "--seconds", "touches=N"});
  }
  expect_named(done({"record", "--sensor", "simulate:A,speed=max", "-o", "s.h5", "--seconds", "1"}),
               {"100 frames"});
}

// A source of poses that never ends a line keeps nobody from ending the recording.
TEST_F(RecordCommand, EndsWhileTheSourceOfPosesNeverDoes) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const pid_t pid = start("s.h5", "simulate:A,rate=1000,speed=5", {"--poses", "/dev/zero"});
    ASSERT_TRUE(appears("s.h5", pid));
    const int status = end(pid, signal);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << bytes_of(folder_ / "complained");
    std::filesystem::remove(folder_ / "s.h5");
  }
}

TEST_F(RecordCommand, UnknownReadingsAreKeptAndCounted) {
  Recording frames = recorded("a.h5", {"--sensor", "simulate:A,touches=1,speed=max"});
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames.pressure[36 * i + i % 36] = std::nan("");
  }
  frames.baseline.clear();
  write_recording(folder_ / "unknown.h5", frames);
  expect_named(done({"record", "--sensor", "replay:unknown.h5,speed=max", "-o", "b.h5"}),
               {"261 frames", "0 lost", "261 readings unknown"});
  const Recording again = read_recording(folder_ / "b.h5");
  ASSERT_EQ(again.pressure.size(), frames.pressure.size());
  for (std::size_t k = 0; k < again.pressure.size(); ++k) {
    EXPECT_TRUE(again.pressure[k] == frames.pressure[k] ||
                (std::isnan(again.pressure[k]) && std::isnan(frames.pressure[k])));
  }
  EXPECT_EQ(again.baseline.size(), 36u);
  expect_named(done({"info", "b.h5"}), {"unknown readings  261 of 9396", "pressure          0 to"});
}

// The clock is set back by an hour in the tare, and again afterwards.
TEST_F(RecordCommand, AClockThatIsSetBackProlongsNothing) {
  Recording frames = recorded("a.h5", {"--sensor", "simulate:A,touches=2,speed=max"});
  for (std::size_t i = 20; i < frames.size(); ++i) {
    frames.time_s[i] -= i < 150 ? 3600.0 : 7200.0;
  }
  frames.baseline.clear();
  write_recording(folder_ / "set.h5", frames);
  const Recording r =
      recorded("b.h5", {"--sensor", "replay:set.h5,speed=max", "--seconds", "2", "--tare", "0.5"});
  // Each step hides the 10 ms between two frames.
  EXPECT_EQ(r.size(), 202u);
  EXPECT_EQ(r.baseline.size(), 36u) << "the first press is at 1.3 s";
}

// info counts the time of such a stream as record does.
TEST_F(RecordCommand, InfoOfAClockThatIsSetBack) {
  Recording frames = recorded("a.h5", {"--sensor", "simulate:A,touches=1,speed=max"});
  for (std::size_t i = 100; i < frames.size(); ++i) {
    frames.time_s[i] -= 3600.0;
  }
  write_recording(folder_ / "set.h5", frames);
  expect_named(done({"record", "--sensor", "replay:set.h5,speed=max", "-o", "b.h5"}),
               {"261 frames in 2.590 s, 100.4 Hz"});
  expect_named(done({"info", "b.h5"}), {"duration          2.590 s", "rate              100.4 Hz"});
}

// What the file holds is counted: frames without a known reading are lost, poses that are no
// numbers are unknown.
TEST_F(RecordCommand, FramesWithoutAKnownReadingCountAsLost) {
  Recording frames = recorded("a.h5", {"--sensor", "simulate:A,touches=1,speed=max"});
  for (const std::size_t i : {10u, 11u, 50u}) {
    std::fill_n(frames.pressure.begin() + static_cast<std::ptrdiff_t>(36 * i), 36, std::nan(""));
  }
  frames.pressure[36 * 20] = std::nan("");
  write_recording(folder_ / "unknown.h5", frames);
  expect_named(done({"record", "--sensor", "replay:unknown.h5,speed=max", "-o", "b.h5"}),
               {"258 frames", "3 lost", "258 with a pose", "1 readings unknown"});
  expect_named(done({"info", "b.h5"}), {"lost              3 ", "with a pose       258 "});
  expect_named(done({"touches", "unknown.h5", "-o", "t.h5"}),
               {"1 touches", "3 lost", "1 readings unknown"});
}

TEST_F(RecordCommand, RefusesWhatCannotBeRecorded) {
  expect_refused({"record", "--sensor", "replay:missing.h5", "-o", "s.h5"}, {"missing.h5"});
  expect_refused({"record", "--sensor", "simulate:A,rate=x", "-o", "s.h5"}, {"rate", "x"});
  expect_refused({"record", "--sensor", "simulate:A", "-o", "no/s.h5"}, {"no/s.h5", "mkdir"});
  expect_refused({"record", "--sensor", "simulate:A", "-o", "s.h5", "--seconds=-1"}, {"--seconds"});
  expect_refused({"record", "--sensor", "simulate:A", "-o", "s.h5", "--tare=nan"}, {"--tare"});
  expect_refused({"record", "--sensor", "simulate:A", "-o", "s.h5", "--poses", "missing"},
                 {"poses missing", "FIFO"});
  expect_refused({"record", "-o", "s.h5"}, {"--sensor"});
}

}  // namespace palpate::record_test
