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
#include <random>
#include <thread>

#include "file_parts.hpp"
#include "io/recording_state.hpp"
#include "numbered_frames.hpp"
#include "palpate/files.hpp"
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
  recorder.add(frame_of(0, 2));
  recorder.close();
  EXPECT_EQ(read_recording(path_).size(), 1u);
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

TEST_F(FrameRecorderFile, RefusesWhatDoesNotFit) {
  FrameRecorder recorder(path_, sensor_of(2));
  expect_named(input_error([&] { recorder.add(frame_of(0, 3)); }), {"3 values", "2 elements"});
  SensorDescription sensor = sensor_of(2);
  sensor.baseline = {1.0};
  expect_named(refusal([&] { FrameRecorder(path_, sensor); }), {"1 baseline"});
  expect_named(refusal([&] { FrameRecorder(path_, {}); }), {"0 elements"});
}

constexpr std::size_t elements = 36;

// What a forked recorder is told, and tells of itself.
struct Progress {
  std::atomic<std::size_t> wanted = 0;
  std::atomic<std::size_t> added = 0;
  std::atomic<std::size_t> flushed = 0;
};

// A recorder in a process of its own, which can be killed.
class FrameRecorderProcess : public FrameRecorderFile {
 protected:
  FrameRecorderProcess()
      : progress_(new (::mmap(nullptr, sizeof(Progress), PROT_READ | PROT_WRITE,
                              MAP_SHARED | MAP_ANONYMOUS, -1, 0)) Progress) {}
  ~FrameRecorderProcess() override { ::munmap(progress_, sizeof(Progress)); }

  // Runs `work` in a process of its own, which must not return to the test.
  pid_t fork_recorder(const std::function<void()>& work) {
    new (progress_) Progress;
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

  template <class Condition>
  static void wait_until(const Condition& condition, pid_t pid) {
    while (!condition()) {
      ASSERT_EQ(::waitpid(pid, nullptr, WNOHANG), 0) << "the recorder has ended";
      std::this_thread::yield();
    }
  }

  static int ending(pid_t pid, int signal = 0) {
    ::kill(pid, signal);
    int status = 0;
    ::waitpid(pid, &status, 0);
    return status;
  }

  void add_next(FrameRecorder& recorder) {
    const std::size_t i = progress_->added++;
    recorder.add(frame_of(i, elements));
  }

  // Expects the stream's beginning in the file, where there is one, and all but the last second of
  // what was added. Removes the file and says whether there was one.
  bool removed_whole() {
    const bool there = std::filesystem::exists(path_);
    std::size_t kept = 0;
    if (there) {
      const Recording read = read_recording(path_);
      expect_prefix(read, elements);
      kept = read.size();
      std::filesystem::remove(path_);
    }
    EXPECT_LE(static_cast<double>(progress_->added - kept) / frame_rate_hz, 1.0);
    return there;
  }

  Progress* progress_;
};

TEST_F(FrameRecorderProcess, FileIsReadAsBeingRecordedFromTheMomentItAppears) {
  for (int run = 0; run < trials(6); ++run) {
    SCOPED_TRACE(run);
    const pid_t pid = fork_recorder([&] {
      FrameRecorder recorder(path_, sensor_of(elements));
      for (progress_->wanted = 1;;) {
        if (progress_->added < progress_->wanted) {
          add_next(recorder);
        } else if (progress_->flushed < progress_->wanted) {
          recorder.flush();
          progress_->flushed = progress_->added.load();
        } else {
          std::this_thread::sleep_for(std::chrono::microseconds(100));  // leaves the test its time
        }
      }
    });
    wait_until([&] { return ::access(path_.c_str(), F_OK) == 0; }, pid);
    EXPECT_TRUE(is_marked_open(path_));
    EXPECT_EQ(recorder_of(path_), Recorder::there);
    for (const std::size_t frames : {1000u, 3000u}) {
      progress_->wanted = frames;
      wait_until([&] { return progress_->flushed == frames; }, pid);
      const Recording read = read_recording(path_);
      EXPECT_FALSE(read.closed);
      EXPECT_EQ(read.size(), frames);
      expect_prefix(read, elements);
    }
    ending(pid, SIGKILL);
    EXPECT_EQ(recorder_of(path_), Recorder::gone);
    std::filesystem::remove(path_);
  }
}

TEST_F(FrameRecorderProcess, KilledAtAnyMomentHoldsAllButTheLastSecond) {
  std::mt19937_64 random(20110509);
  const int runs = trials(20);
  int appeared = 0;
  for (int run = 0; run < runs; ++run) {
    SCOPED_TRACE(run);
    // As fast as the machine can: most of the time goes into saving, where a kill hurts most.
    const pid_t pid = fork_recorder([&] {
      FrameRecorder recorder(path_, sensor_of(elements));
      for (;;) {
        add_next(recorder);
      }
    });
    // A number of frames, not a time, so that a slow machine is as far; then some way into saving.
    const std::size_t frames = random() % 5000;
    wait_until([&] { return progress_->added >= frames; }, pid);
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 2000));
    ending(pid, SIGKILL);
    appeared += removed_whole() ? 1 : 0;
  }
  EXPECT_GE(appeared, runs * 3 / 4);  // the first rows are saved after 250 frames
}

TEST_F(FrameRecorderProcess, FullDiskIsOneErrorAndLeavesWhatWasSaved) {
  std::signal(SIGXFSZ, SIG_IGN);  // errors of writing, not signals
  std::mt19937_64 random(7);
  const int runs = trials(10);
  int appeared = 0;
  for (int run = 0; run < runs; ++run) {
    SCOPED_TRACE(run);
    const rlim_t bytes = 1000 + random() % 1500000;
    const pid_t pid = fork_recorder([&] {
      const rlimit limit{.rlim_cur = bytes, .rlim_max = bytes};
      ::setrlimit(RLIMIT_FSIZE, &limit);
      const std::string said = error_of(Fault::system, [&] {
        FrameRecorder recorder(path_, sensor_of(elements));
        while (progress_->added < 20000) {
          add_next(recorder);
        }
      });
      expect_named(said, {"stream.h5", "File too large"});
      std::exit(HasFailure() ? 1 : 0);  // as a program ends: HDF5 crashes then, if it is not closed
    });
    EXPECT_EQ(ending(pid), 0);
    appeared += removed_whole() ? 1 : 0;
  }
  std::signal(SIGXFSZ, SIG_DFL);
  EXPECT_GE(appeared, runs / 2);
}

}  // namespace palpate::frame_recorder_test
