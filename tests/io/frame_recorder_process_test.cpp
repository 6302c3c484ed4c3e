// What a recorder leaves while it records, when it is killed and when the disk is full.

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <random>
#include <thread>

#include "io/recording_state.hpp"
#include "numbered_frames.hpp"
#include "palpate/files.hpp"
#include "palpate/frame_recorder.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::frame_recorder_process_test {

using namespace std::chrono_literals;

// What a forked recorder tells of itself.
struct Progress {
  std::atomic<std::size_t> added = 0;
  std::atomic<int> stage = 0;
};

class FrameRecorderProcess : public testing::Test {
 protected:
  FrameRecorderProcess()
      : progress_(new (::mmap(nullptr, sizeof(Progress), PROT_READ | PROT_WRITE,
                              MAP_SHARED | MAP_ANONYMOUS, -1, 0)) Progress) {}
  ~FrameRecorderProcess() override { ::munmap(progress_, sizeof(Progress)); }

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

// Whoever sees the file sees that it is being recorded.
TEST_F(FrameRecorderProcess, AppearsAsBeingRecorded) {
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

TEST_F(FrameRecorderProcess, CanBeReadWhileItIsRecorded) {
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

TEST_F(FrameRecorderProcess, KilledAtAnyMomentHoldsAllButTheLastSecond) {
  constexpr std::size_t elements = 36;
  std::mt19937_64 random(20110509);
  int appeared = 0;
  for (int run = 0; run < 40; ++run) {
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
      EXPECT_LE(static_cast<double>(progress_->added) / frame_rate_hz, 1.0);
      continue;
    }
    ++appeared;
    const Recording read = read_recording(path_);
    expect_prefix(read, elements);
    EXPECT_LE(static_cast<double>(progress_->added - read.size()) / frame_rate_hz, 1.0);
    std::filesystem::remove(path_);
  }
  EXPECT_GE(appeared, 32);  // the first rows are saved after 250 frames
}

TEST_F(FrameRecorderProcess, FullDiskIsOneErrorAndLeavesWhatWasSaved) {
  constexpr std::size_t elements = 36;
  // Errors of writing, not signals.
  std::signal(SIGXFSZ, SIG_IGN);
  std::mt19937_64 random(7);
  int partial = 0;
  for (int run = 0; run < 20; ++run) {
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
      EXPECT_LE(static_cast<double>(progress_->added - read.size()) / frame_rate_hz, 1.0);
      std::filesystem::remove(path_);
    } else {
      EXPECT_LE(static_cast<double>(progress_->added) / frame_rate_hz, 1.0);
    }
  }
  std::signal(SIGXFSZ, SIG_DFL);
  EXPECT_GE(partial, 10);
}

}  // namespace palpate::frame_recorder_process_test
