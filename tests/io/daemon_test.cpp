// A daemon has closed its standard input, output and error: the next files to be opened would be
// given their numbers, and whatever is printed would go into them.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>

#include "palpate/files.hpp"
#include "palpate/frame_recorder.hpp"
#include "scratch_folder.hpp"

namespace palpate::daemon_test {

// Prints on standard output and error, whatever they are, as libraries and drivers do.
bool print_anything() {
  const char text[] = "something that was printed";
  return ::write(STDOUT_FILENO, text, sizeof text) > 0 ||
         ::write(STDERR_FILENO, text, sizeof text) > 0;
}

class Daemon : public testing::Test {
 protected:
  // Runs the work in a process with these descriptors closed; true where it says so.
  static bool does(std::initializer_list<int> closed, const std::function<bool()>& work) {
    const pid_t pid = ::fork();
    if (pid == 0) {
      for (const int descriptor : closed) {
        ::close(descriptor);
      }
      bool done = false;
      try {
        done = work();
      } catch (...) {
        done = false;
      }
      ::_exit(done ? 0 : 1);
    }
    int status = -1;
    ::waitpid(pid, &status, 0);
    return status == 0;
  }

  ScratchFolder folder_;
  std::filesystem::path path_ = folder_ / "r.h5";
};

Recording one_touch() {
  Recording recording;
  recording.T_robot_sensor = {{{1.0, 2.0}, 3.0}};
  recording.pressure = {0.5, 1.5};
  recording.elements_mm = {{0.0, 0.0}, {1.0, 0.0}};
  return recording;
}

TEST_F(Daemon, WritesAndReadsWithAnyStandardDescriptorsClosed) {
  for (const auto& closed : {std::initializer_list<int>{0}, {0, 1}, {1, 2}, {0, 1, 2}, {2}}) {
    EXPECT_TRUE(does(closed, [&] {
      write_recording(path_, one_touch());
      return read_recording(path_).pressure == one_touch().pressure;
    })) << closed.size();
  }
}

TEST_F(Daemon, NothingPrintedGetsIntoARecording) {
  EXPECT_TRUE(does({1, 2}, [&] {
    SensorDescription sensor;
    sensor.elements_mm = {{0.0, 0.0}};
    FrameRecorder recorder(path_, sensor);
    bool printed = false;
    for (int i = 0; i < 10; ++i) {
      recorder.add({.host_time_s = 1e9 + i, .values = {1.0 * i}});
      recorder.flush();
      printed = printed || print_anything();
    }
    recorder.close();
    return !printed;
  }));
  EXPECT_EQ(read_recording(path_).size(), 10u);
}

}  // namespace palpate::daemon_test
