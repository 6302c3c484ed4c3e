#include "palpate/frame_recorder.hpp"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <limits>
#include <random>
#include <thread>

#include "palpate/files.hpp"
#include "recording_state.hpp"
#include "scratch_folder.hpp"

namespace palpate {
namespace {

using namespace std::chrono_literals;

constexpr double rate_hz = 1000.0;
constexpr double start_s = 1.7e9;

SensorDescription sensor_of(std::size_t elements) {
  SensorDescription sensor{.name = "Test", .serial = "7"};
  for (std::size_t i = 0; i < elements; ++i) {
    sensor.elements_mm.emplace_back(static_cast<double>(i), -0.5);
  }
  return sensor;
}

// Numbers that say where they stand, and that float32 holds exactly.
double reading(std::size_t frame, std::size_t element) {
  return static_cast<double>(frame % 65536) + static_cast<double>(element) / 64.0;
}

Frame frame_of(std::size_t i, std::size_t elements) {
  Frame frame{.host_time_s = start_s + static_cast<double>(i) / rate_hz, .values = {}};
  for (std::size_t k = 0; k < elements; ++k) {
    frame.values.push_back(reading(i, k));
  }
  return frame;
}

// The recording holds the first frames of the stream, as they were.
void expect_prefix(const Recording& recording, std::size_t elements) {
  EXPECT_EQ(recording.rows, "frames");
  ASSERT_EQ(recording.elements(), elements);
  for (std::size_t i = 0; i < recording.size(); ++i) {
    ASSERT_EQ(recording.time_s[i], start_s + static_cast<double>(i) / rate_hz) << i;
    for (std::size_t k = 0; k < elements; ++k) {
      ASSERT_EQ(recording.pressure[i * elements + k], reading(i, k)) << i;
    }
  }
}

// What a forked recorder tells of itself.
struct Progress {
  std::atomic<std::size_t> added = 0;
  std::atomic<int> stage = 0;
};

class FrameRecorderFile : public testing::Test {
 protected:
  FrameRecorderFile()
      : progress_(new (::mmap(nullptr, sizeof(Progress), PROT_READ | PROT_WRITE,
                              MAP_SHARED | MAP_ANONYMOUS, -1, 0)) Progress) {}
  ~FrameRecorderFile() override { ::munmap(progress_, sizeof(Progress)); }

  // Runs `work` in a process of its own, which must not return to the test.
  pid_t fork_recorder(const std::function<void()>& work) {
    progress_->added = 0;
    progress_->stage = 0;
    const pid_t pid = ::fork();
    if (pid == 0) {
      try {
        work();
      } catch (...) {
        ::_exit(3);
      }
      ::_exit(0);
    }
    return pid;
  }

  void wait_for_stage(int stage, pid_t pid) const {
    while (progress_->stage < stage) {
      ASSERT_EQ(::waitpid(pid, nullptr, WNOHANG), 0) << "the recorder has ended";
      std::this_thread::sleep_for(1ms);
    }
  }

  static int ending(pid_t pid) {
    int status = 0;
    ::waitpid(pid, &status, 0);
    return status;
  }

  ScratchFolder folder_;
  std::filesystem::path path_ = folder_ / "stream.h5";
  Progress* progress_;
};

TEST_F(FrameRecorderFile, ComesBackAsItWasAdded) {
  SensorDescription sensor = sensor_of(3);
  sensor.pressure_unit = "raw";
  sensor.valid = {1, 0, 1};
  sensor.baseline = {10.0, 0.0, 12.5};
  sensor.object = "A";
  sensor.truth = {.object = "E", .T_object_robot = {{1.0, 2.0}, 3.0}};
  constexpr std::size_t n = 1000;
  FrameRecorder recorder(path_, sensor);
  for (std::size_t i = 0; i < n; ++i) {
    Frame frame = frame_of(i, 3);
    frame.device_time_s = static_cast<double>(i);
    frame.lost_before = i % 5 == 0 ? 2 : 0;
    if (i % 2 == 0) {
      frame.T_robot_sensor = Pose{{static_cast<double>(i), 0.25}, -9.0};
    }
    recorder.add(frame);
  }
  EXPECT_EQ(recorder.frames(), n);
  EXPECT_EQ(recorder.lost(), 2 * n / 5);
  recorder.close();

  const Recording read = read_recording(path_);
  EXPECT_TRUE(read.closed);
  ASSERT_EQ(read.size(), n);
  expect_prefix(read, 3);
  EXPECT_EQ(read.sensor, "Test");
  EXPECT_EQ(read.serial, "7");
  EXPECT_EQ(read.pressure_unit, "raw");
  EXPECT_EQ(read.object, "A");
  EXPECT_EQ(read.elements_mm, sensor.elements_mm);
  EXPECT_EQ(read.valid, sensor.valid);
  EXPECT_EQ(read.baseline, sensor.baseline);
  ASSERT_TRUE(read.truth);
  EXPECT_EQ(read.truth->object, "E");
  EXPECT_EQ(read.truth->T_object_robot.theta_rad, 3.0);
  EXPECT_EQ(read.device_time_s[17], 17.0);
  EXPECT_EQ(read.lost_before[15], 2u);
  EXPECT_EQ(read.lost_before[16], 0u);
  EXPECT_EQ(read.T_robot_sensor[16].translation_mm, glm::dvec2(16.0, 0.25));
  EXPECT_EQ(read.T_robot_sensor[16].theta_rad, -9.0);
  EXPECT_TRUE(std::isnan(read.T_robot_sensor[17].theta_rad));
}

TEST_F(FrameRecorderFile, AppearsOnlyWithFrames) {
  put_bytes(path_, "an older file");
  {
    FrameRecorder recorder(path_, sensor_of(2));
    recorder.flush();
    recorder.close();
  }
  EXPECT_EQ(bytes_of(path_), "an older file");
  FrameRecorder recorder(path_, sensor_of(2));
  recorder.add(frame_of(0, 2));
  recorder.close();
  EXPECT_EQ(read_recording(path_).size(), 1u);
}

TEST_F(FrameRecorderFile, FrameWithAReadingThatIsNoNumberCountsAsLost) {
  SensorDescription sensor = sensor_of(2);
  sensor.valid = {1, 0};
  FrameRecorder recorder(path_, sensor);
  recorder.add(frame_of(0, 2));
  for (const double wrong : {std::nan(""), 1e300}) {  // no number, and none in float32
    Frame frame = frame_of(1, 2);
    frame.values[0] = wrong;
    recorder.add(frame);
  }
  Frame dead = frame_of(2, 2);
  dead.values[1] = std::nan("");
  recorder.add(dead);
  recorder.close();
  const Recording read = read_recording(path_);
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(recorder.lost(), 2u);
  EXPECT_EQ(read.lost_before, (std::vector<std::uint64_t>{0, 2}));
}

TEST_F(FrameRecorderFile, UnknownReadingsComeBackAsNaNs) {
  SensorDescription sensor = sensor_of(3);
  sensor.valid = {1, 1, 0};
  FrameRecorder recorder(path_, sensor);
  const double inf = std::numeric_limits<double>::infinity();
  for (const double none : {std::nan(""), inf, -inf, 1e300, -3.5e38}) {
    Frame frame = frame_of(recorder.frames(), 3);
    frame.values[1] = none;
    frame.values[2] = none;  // a dead element's does not count
    recorder.add(frame);
  }
  recorder.add(frame_of(5, 3));
  EXPECT_EQ(recorder.frames(), 6u);
  EXPECT_EQ(recorder.lost(), 0u);
  EXPECT_EQ(recorder.unknown_readings(), 5u);
  recorder.close();
  const Recording read = read_recording(path_);
  ASSERT_EQ(read.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(read.pressure[3 * i], reading(i, 0));
    EXPECT_EQ(std::isnan(read.pressure[3 * i + 1]), i < 5) << i;
  }
  // What was read can be written and read again; touches must be whole.
  write_recording(folder_ / "again.h5", read);
  EXPECT_TRUE(std::isnan(read_recording(folder_ / "again.h5").pressure[1]));
  Recording touches = read;
  touches.rows = "touches";
  touches.T_robot_sensor.assign(6, {});
  expect_named(input_error([&] { write_recording(folder_ / "touches.h5", touches); }),
               {"'pressure'[0, 1]", "nan"});
}

TEST_F(FrameRecorderFile, BaselineMayFollowTheFrames) {
  for (const std::size_t flushed : {0u, 5u}) {
    FrameRecorder recorder(path_, sensor_of(2));
    recorder.expect_baseline();
    for (std::size_t i = 0; i < 5; ++i) {
      recorder.add(frame_of(i, 2));
    }
    if (flushed > 0) {
      recorder.flush();
      EXPECT_EQ(read_recording(path_).size(), 5u);
      EXPECT_TRUE(read_recording(path_).baseline.empty()) << "not taken yet";
    }
    expect_named(input_error([&] { recorder.set_baseline({1.0}); }), {"1 baseline", "2 elements"});
    recorder.set_baseline({1.5, -2.0});
    recorder.add(frame_of(5, 2));
    recorder.close();
    const Recording read = read_recording(path_);
    EXPECT_EQ(read.baseline, (std::vector<double>{1.5, -2.0})) << flushed;
    ASSERT_EQ(read.size(), 6u);
    expect_prefix(read, 2);
  }
}

TEST_F(FrameRecorderFile, ABaselineThatHasNoPlaceCostsNothing) {
  for (const bool expected : {true, false}) {
    FrameRecorder recorder(path_, sensor_of(2));
    if (expected) {
      recorder.expect_baseline();
    }
    recorder.add(frame_of(0, 2));
    recorder.flush();
    expect_named(input_error([&] { recorder.set_baseline({}); }), {"stream.h5", "baseline"});
    if (!expected) {
      expect_named(input_error([&] {
                     recorder.set_baseline({1.0, 2.0});
                   }),
                   {"stream.h5", "baseline", "before the first frame"});
    }
    recorder.add(frame_of(1, 2));
    recorder.close();
    const Recording read = read_recording(path_);
    EXPECT_EQ(read.size(), 2u);
    EXPECT_TRUE(read.baseline.empty());
    expect_prefix(read, 2);
  }
}

// Whoever sees the file sees that it is being recorded.
TEST_F(FrameRecorderFile, AppearsAsBeingRecorded) {
  for (int run = 0; run < 30; ++run) {
    SCOPED_TRACE(run);
    const pid_t pid = fork_recorder([&] {
      FrameRecorder recorder(path_, sensor_of(2));
      recorder.add(frame_of(0, 2));
      recorder.flush();
      ::pause();
    });
    while (::access(path_.c_str(), F_OK) != 0) {
      ASSERT_EQ(::waitpid(pid, nullptr, WNOHANG), 0) << "the recorder has ended";
    }
    EXPECT_TRUE(is_marked_open(path_));
    EXPECT_EQ(recorder_of(path_), Recorder::there);
    ::kill(pid, SIGKILL);
    ending(pid);
    EXPECT_EQ(recorder_of(path_), Recorder::gone);
    std::filesystem::remove(path_);
  }
}

TEST_F(FrameRecorderFile, RefusesWhatDoesNotFit) {
  FrameRecorder recorder(path_, sensor_of(2));
  expect_named(input_error([&] { recorder.add(frame_of(0, 3)); }), {"3 values", "2 elements"});
  SensorDescription sensor = sensor_of(2);
  sensor.baseline = {1.0};
  expect_named(input_error([&] { FrameRecorder(path_, sensor); }), {"stream.h5", "1 baseline"});
  expect_named(input_error([&] { FrameRecorder(path_, {}); }), {"0 elements"});
}

TEST_F(FrameRecorderFile, CanBeReadWhileItIsRecorded) {
  const pid_t pid = fork_recorder([&] {
    FrameRecorder recorder(path_, sensor_of(4));
    for (std::size_t i = 0;; ++i) {
      recorder.add(frame_of(i, 4));
      if (i == 999 || i == 4999) {
        recorder.flush();
        ++progress_->stage;
        std::this_thread::sleep_for(i == 999 ? 300ms : 60s);
      }
    }
  });
  for (const auto& [stage, frames] : {std::pair{1, 1000u}, {2, 5000u}}) {
    wait_for_stage(stage, pid);
    ASSERT_FALSE(HasFatalFailure());
    const Recording read = read_recording(path_);
    EXPECT_FALSE(read.closed);
    EXPECT_GE(read.size(), frames);
    expect_prefix(read, 4);
  }
  ::kill(pid, SIGKILL);
  ending(pid);
}

TEST_F(FrameRecorderFile, KilledAtAnyMomentHoldsAllButTheLastSecond) {
  constexpr std::size_t elements = 36;
  std::mt19937_64 random(20110509);
  int appeared = 0;
  for (int run = 0; run < 100; ++run) {
    SCOPED_TRACE(run);
    // As fast as the machine can: most of the time goes into saving, where a kill hurts most.
    const pid_t pid = fork_recorder([&] {
      FrameRecorder recorder(path_, sensor_of(elements));
      for (std::size_t i = 0;; ++i) {
        progress_->added = i + 1;
        recorder.add(frame_of(i, elements));
      }
    });
    // A number of frames, not a time, so that a slow machine is as far; then some way into saving.
    const std::size_t frames = random() % 5000;
    while (progress_->added < frames) {
      ASSERT_EQ(::waitpid(pid, nullptr, WNOHANG), 0) << "the recorder has ended";
      std::this_thread::sleep_for(50us);
    }
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 2000));
    ::kill(pid, SIGKILL);
    ending(pid);
    if (!std::filesystem::exists(path_)) {
      EXPECT_LE(static_cast<double>(progress_->added) / rate_hz, 1.0);
      continue;
    }
    ++appeared;
    const Recording read = read_recording(path_);
    expect_prefix(read, elements);
    EXPECT_LE(static_cast<double>(progress_->added - read.size()) / rate_hz, 1.0);
    std::filesystem::remove(path_);
  }
  EXPECT_GE(appeared, 80);  // the first rows are saved after 250 frames
}

TEST_F(FrameRecorderFile, FullDiskIsOneErrorAndLeavesWhatWasSaved) {
  constexpr std::size_t elements = 36;
  // Errors of writing, not signals.
  std::signal(SIGXFSZ, SIG_IGN);
  std::mt19937_64 random(7);
  int partial = 0;
  for (int run = 0; run < 40; ++run) {
    SCOPED_TRACE(run);
    const rlim_t bytes = 1000 + random() % 1500000;
    const pid_t pid = fork_recorder([&] {
      const rlimit limit{.rlim_cur = bytes, .rlim_max = bytes};
      ::setrlimit(RLIMIT_FSIZE, &limit);
      int status = 2;
      try {
        FrameRecorder recorder(path_, sensor_of(elements));
        for (std::size_t i = 0; i < 20000; ++i) {
          progress_->added = i + 1;
          recorder.add(frame_of(i, elements));
        }
      } catch (const Error& error) {
        const std::string said = error.what();
        const bool clear = error.fault() == Fault::system &&
                           said.find("stream.h5") != std::string::npos &&
                           said.find("File too large") != std::string::npos;
        status = clear ? 0 : 1;
      }
      std::exit(status);  // as a program ends: HDF5 crashes then, where it could not close
    });
    EXPECT_EQ(ending(pid), 0);
    if (std::filesystem::exists(path_)) {
      ++partial;
      const Recording read = read_recording(path_);
      expect_prefix(read, elements);
      EXPECT_LE(static_cast<double>(progress_->added - read.size()) / rate_hz, 1.0);
      std::filesystem::remove(path_);
    } else {
      EXPECT_LE(static_cast<double>(progress_->added) / rate_hz, 1.0);
    }
  }
  std::signal(SIGXFSZ, SIG_DFL);
  EXPECT_GE(partial, 20);
}

}  // namespace
}  // namespace palpate
