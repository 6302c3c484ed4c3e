#include "palpate/frame_recorder.hpp"

#include <gtest/gtest.h>
#include <sys/mman.h>

#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <limits>
#include <random>

#include "file_parts.hpp"
#include "io/recording_state.hpp"
#include "numbered_frames.hpp"
#include "palpate/files.hpp"
#include "support/child_process.hpp"
#include "support/limits.hpp"
#include "support/trials.hpp"

namespace palpate::frame_recorder_test {

class FrameRecorderFile : public OneFile {
 protected:
  FrameRecorderFile() : OneFile("stream.h5") {}
};

TEST_F(FrameRecorderFile, AppearsOnlyWithFrames) {
  put_bytes(path_, "an older file");
  {
    FrameRecorder recorder(path_, sensor_of(2));
    recorder.flush();
    recorder.close();
  }
  EXPECT_EQ(bytes_of(path_), "an older file");
  FrameRecorder recorder(path_, sensor_of(2));
  Frame frame = frame_of(0, 2);
  frame.lost_before = std::numeric_limits<std::uint64_t>::max();  // more than a file holds
  recorder.add(frame);
  recorder.close();
  EXPECT_EQ(recorder.lost(), std::uint64_t{1} << 53);
  EXPECT_EQ(read_recording(path_).lost_before, (std::vector{std::uint64_t{1} << 53}));
}

TEST_F(FrameRecorderFile, WithoutAKnownReadingIsLostAndWithOneHasTheOthersUnknown) {
  SensorDescription sensor = sensor_of(3);
  sensor.valid = {1, 1, 0};  // what a dead element reads does not count
  FrameRecorder recorder(path_, sensor);
  const auto add = [&](std::vector<double> values) {
    Frame frame = frame_of(recorder.frames(), 3);
    frame.values = std::move(values);
    frame.lost_before = recorder.frames() == 0 ? 2 : 0;
    recorder.add(frame);
  };
  add({1.0, 2.0, nan});
  for (const double none : {nan, infinity, -infinity, 1e300, -3.5e38}) {  // the last in float32
    add({none, none, 4.0});
    add({1.0, none, none});
  }
  EXPECT_EQ(recorder.frames(), 6u);
  EXPECT_EQ(recorder.lost(), 7u);
  EXPECT_EQ(recorder.unknown_readings(), 5u);
  recorder.close();
  const Recording read = read_recording(path_);
  ASSERT_EQ(read.size(), 6u);
  EXPECT_EQ(read.lost_before, (std::vector<std::uint64_t>{2, 1, 1, 1, 1, 1}));
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(read.pressure[3 * i], 1.0);
    EXPECT_EQ(std::isnan(read.pressure[3 * i + 1]), i > 0) << i;
  }
}

TEST_F(FrameRecorderFile, KeepsWhatItsSensorSaysAndDropsPosesAndTimesThatAreNone) {
  SensorDescription sensor = sensor_of(1);
  sensor.name = "caf\xe9";
  sensor.object = "Ä";
  sensor.pressure_unit = "raw";
  sensor.baseline = {-0.0};
  sensor.truth = {.object = "B", .T_object_robot = {{1.0, 2.0}, 3.0}};
  FrameRecorder recorder(path_, sensor);
  recorder.add(frame_of(0, 1));
  Frame frame = frame_of(1, 1);
  frame.device_time_s = infinity;
  for (const Pose& none : {Pose{{nan, 0.0}, 0.0}, Pose{{0.0, infinity}, 0.0}, Pose{{}, nan}}) {
    frame.T_robot_sensor = none;
    recorder.add(frame);
  }
  frame.host_time_s = nan;
  recorder.add(frame);
  EXPECT_EQ(recorder.frames(), 4u);
  EXPECT_EQ(recorder.lost(), 1u);
  EXPECT_EQ(recorder.with_pose(), 1u);
  recorder.close();
  const Recording read = read_recording(path_);
  EXPECT_TRUE(read.closed);
  EXPECT_EQ(read.sensor, "caf?");
  EXPECT_EQ(read.object, "Ä");
  EXPECT_EQ(read.pressure_unit, "raw");
  EXPECT_EQ(read.truth.value().object, "B");
  EXPECT_EQ(read.truth->T_object_robot.translation_mm, glm::dvec2(1.0, 2.0));
  EXPECT_EQ(bits_of(read.baseline), bits_of(sensor.baseline));
  EXPECT_EQ(bits_of(read.device_time_s), bits_of(std::vector{0.0, nan, nan, nan}));
  const Pose none{{nan, nan}, nan};
  EXPECT_EQ(bits_of(read.T_robot_sensor),
            bits_of(std::vector{*frame_of(0, 1).T_robot_sensor, none, none, none}));
}

TEST_F(FrameRecorderFile, RefusesWhatDoesNotFit) {
  FrameRecorder recorder(path_, sensor_of(2));
  expect_named(input_error([&] { recorder.add(frame_of(0, 3)); }), {"3 values", "2 elements"});
  using Sensor = SensorDescription;
  const std::pair<const char*, std::function<void(Sensor&)>> sensors[] = {
      {"1 baseline", [](Sensor& s) { s.baseline = {1.0}; }},
      {"1 valid", [](Sensor& s) { s.valid = {1}; }},
      {"0 elements", [](Sensor& s) { s.elements_mm.clear(); }},
      {"'elements', position 1", [](Sensor& s) { s.elements_mm[1].x = nan; }},
      {"'object'", [](Sensor& s) { s.object = "\xff"; }}};
  for (const auto& [named, spoil] : sensors) {
    SensorDescription sensor = sensor_of(2);
    spoil(sensor);
    expect_named(refusal([&, &sensor = sensor] { FrameRecorder(path_, sensor); }), {named});
  }
}

constexpr std::size_t elements = 36;

// A recorder in a process of its own, which can be killed.
class FrameRecorderProcess : public FrameRecorderFile {
 protected:
  using Count = std::atomic<std::size_t>;

  // Adds a frame and counts it.
  void add_next(FrameRecorder& recorder) { recorder.add(frame_of(added_++, elements)); }

  // Expects of recorders in processes of their own that end with this status: the stream's
  // beginning in the file, where there is one, and all but the last second of what was added.
  void expect_whole(int runs, int status, const std::function<void()>& record) {
    int appeared = 0;
    for (int run = 0; run < runs; ++run) {
      SCOPED_TRACE(run);
      random_.discard(4);  // each run has draws of its own
      EXPECT_EQ(status_of(record), status);
      std::size_t kept = 0;
      if (std::filesystem::exists(path_)) {
        const Recording read = read_recording(path_);
        expect_prefix(read, elements);
        kept = read.size();
        std::filesystem::remove(path_);
        ++appeared;
      }
      EXPECT_LE(static_cast<double>(added_.exchange(0) - kept) / frame_rate_hz, 1.0);
    }
    EXPECT_GE(appeared, runs / 2);  // the first rows are saved after 250 frames
  }

  std::mt19937_64 random_{20110509};
  // Of all processes.
  Count& added_ = *new (::mmap(nullptr, sizeof(Count), PROT_READ | PROT_WRITE,
                               MAP_SHARED | MAP_ANONYMOUS, -1, 0)) Count(0);
};

TEST_F(FrameRecorderProcess, FileIsReadAsBeingRecordedFromTheMomentItAppears) {
  for (int run = 0; run < trials(6); ++run) {
    SCOPED_TRACE(run);
    const pid_t pid = start_child([&] {
      FrameRecorder recorder(path_, sensor_of(elements));
      for (const std::size_t frames : {1000u, 3000u}) {
        while (recorder.frames() < frames) {
          recorder.add(frame_of(recorder.frames(), elements));
        }
        recorder.flush();
        ::raise(SIGSTOP);
      }
    });
    siginfo_t state{};  // of the process: none while it runs
    while (!std::filesystem::exists(path_) && state.si_pid == 0) {
      ::waitid(P_PID, static_cast<id_t>(pid), &state, WSTOPPED | WEXITED | WNOHANG | WNOWAIT);
    }
    EXPECT_TRUE(is_marked_open(path_));
    EXPECT_EQ(recorder_of(path_), Recorder::there);
    for (const std::size_t frames : {1000u, 3000u}) {
      int status = 0;
      ::waitpid(pid, &status, WUNTRACED);
      ASSERT_TRUE(WIFSTOPPED(status));
      const Recording read = read_recording(path_);
      EXPECT_FALSE(read.closed);
      EXPECT_EQ(read.size(), frames);
      expect_prefix(read, elements);
      ::kill(pid, frames == 1000 ? SIGCONT : SIGKILL);
    }
    ::waitpid(pid, nullptr, 0);
    EXPECT_EQ(recorder_of(path_), Recorder::gone);
    std::filesystem::remove(path_);
  }
}

TEST_F(FrameRecorderProcess, KilledAtAnyMomentHoldsAllButTheLastSecond) {
  expect_whole(trials(20), SIGALRM, [&] {
    // As fast as the machine can: most of the time goes into saving, where a kill hurts most. After
    // a number of frames, not a time, so that a slow machine is as far; then some way into saving.
    const std::size_t frames = random_() % 5000;
    const auto into_saving_us = static_cast<useconds_t>(1 + random_() % 2000);
    FrameRecorder recorder(path_, sensor_of(elements));
    for (;;) {
      if (added_ == frames) {
        ::ualarm(into_saving_us, 0);
      }
      add_next(recorder);
    }
  });
}

TEST_F(FrameRecorderProcess, FullDiskIsOneErrorAndLeavesWhatWasSaved) {
  expect_whole(trials(10), 0, [&] {
    std::signal(SIGXFSZ, SIG_IGN);  // errors of writing, not signals
    limit_process(RLIMIT_FSIZE, 1000 + random_() % 1500000);
    const std::string said = error_of(Fault::system, [&] {
      FrameRecorder recorder(path_, sensor_of(elements));
      while (added_ < 20000) {
        add_next(recorder);
      }
    });
    expect_named(said, {"stream.h5", "File too large"});
    std::exit(HasFailure() ? 1 : 0);  // as a program ends: HDF5 crashes then, if it is not closed
  });
}

}  // namespace palpate::frame_recorder_test
