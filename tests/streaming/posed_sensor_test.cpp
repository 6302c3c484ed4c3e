#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <thread>
#include <vector>

#include "palpate/pose_track.hpp"
#include "support/host_locale.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::posed_sensor_test {

using namespace std::chrono_literals;

// Frames 10 ms apart from 100 s on, all at once.
class ListedSensor : public Sensor {
 public:
  explicit ListedSensor(std::size_t frames) : left_(frames) {
    description_.elements_mm = {{0.0, 0.0}};
  }
  const SensorDescription& description() const override { return description_; }
  void start() override {}
  std::optional<Frame> next(std::chrono::milliseconds) override {
    if (left_ == 0) {
      return {};
    }
    --left_;
    Frame frame{.host_time_s = 100.0 + 0.01 * static_cast<double>(counters_.frames++),
                .values = {0.0}};
    return frame;
  }
  bool ended() const override { return left_ == 0; }
  void stop() override {}
  SensorCounters counters() const override { return counters_; }

 private:
  std::size_t left_;
  SensorDescription description_;
  SensorCounters counters_;
};

std::string line(double time_s, double x_mm) {
  return fmt::format("{{\"time\": {}, \"x_mm\": {}, \"y_mm\": 1, \"theta_rad\": 0.5}}\n", time_s,
                     x_mm);
}

std::vector<Frame> frames_of(Sensor& sensor) {
  std::vector<Frame> frames;
  sensor.start();
  while (!sensor.ended()) {
    if (auto frame = sensor.next(1s)) {
      frames.push_back(std::move(*frame));
    }
  }
  return frames;
}

class PosedSensorSource : public testing::Test {
 protected:
  PosedSensor open(std::size_t frames, double gap_s = 0.1) {
    return PosedSensor(std::make_unique<ListedSensor>(frames), path_.string(), gap_s);
  }

  ScratchFolder folder_;
  std::filesystem::path path_ = folder_ / "poses";
};

TEST_F(PosedSensorSource, FileGivesEveryFrameItsPose) {
  std::string text = "\n";
  for (int i = 0; i <= 10; ++i) {
    text += line(99.995 + 0.05 * i, 10.0 * i);
  }
  put_bytes(path_, text);
  PosedSensor sensor = open(100);
  const std::vector<Frame> frames = frames_of(sensor);
  ASSERT_EQ(frames.size(), 100u);
  for (const Frame& frame : frames) {
    if (frame.host_time_s > 100.495) {
      EXPECT_FALSE(frame.T_robot_sensor);
    } else {
      ASSERT_TRUE(frame.T_robot_sensor) << frame.host_time_s;
      // Times are good to 1e-14 of 100 s, and 200 mm pass in a second.
      EXPECT_NEAR(frame.T_robot_sensor->translation_mm.x, 200.0 * (frame.host_time_s - 99.995),
                  1e-9);
    }
  }
  const PosedSensor::Poses poses = sensor.poses();
  EXPECT_EQ(poses.read, 11u);
  EXPECT_EQ(poses.refused, 0u);
  EXPECT_EQ(poses.frames, 50u);
  EXPECT_EQ(poses.without, 50u);
}

TEST_F(PosedSensorSource, HostProgramWithDecimalCommasReadsTheSame) {
  put_bytes(path_, "{\"time\": 100.000, \"x_mm\": 1.500, \"y_mm\": -0.125, \"theta_rad\": 5e-1}\n");
  const HostLocale locale;
  PosedSensor sensor = open(1);
  const std::vector<Frame> frames = frames_of(sensor);
  ASSERT_TRUE(frames.at(0).T_robot_sensor);
  EXPECT_EQ(frames[0].T_robot_sensor->translation_mm, glm::dvec2(1.5, -0.125));
  EXPECT_EQ(frames[0].T_robot_sensor->theta_rad, 0.5);
}

// A daemon has closed its standard input; the number 0 does not make it the file of poses.
TEST_F(PosedSensorSource, FileIsClosedAgainInAProcessWithoutStandardInput) {
  put_bytes(path_, line(100.0, 0.0));
  const pid_t pid = ::fork();
  if (pid == 0) {
    ::close(STDIN_FILENO);
    open(1);
    ::_exit(::fcntl(STDIN_FILENO, F_GETFD) < 0 ? 0 : 1);
  }
  int status = -1;
  ::waitpid(pid, &status, 0);
  EXPECT_EQ(status, 0);
}

TEST_F(PosedSensorSource, LastLineOfAFileNeedsNoEnd) {
  std::string text = line(99.9, 1.0) + line(100.1, 2.0);
  text.pop_back();
  put_bytes(path_, text);
  PosedSensor sensor = open(1, 1.0);
  ASSERT_TRUE(frames_of(sensor)[0].T_robot_sensor);
}

TEST_F(PosedSensorSource, FileWithABadLineIsRefusedByNumber) {
  for (const auto& [bad, named] :
       {std::pair{"nonsense\n", "JSON"},
        {"[1, 2]\n", "JSON"},
        {"{\"time\": 1}\n", "'x_mm'"},
        {"{\"x_mm\": 1, \"y_mm\": 1, \"theta_rad\": 1}\n", "'time'"},
        {"{\"time\": 1, \"x_mm\": \"1\", \"y_mm\": 1, \"theta_rad\": 1}\n", "'x_mm'"},
        {"{\"time\": 1, \"x_mm\": 1, \"y_mm\": 1e999, \"theta_rad\": 1}\n", ""},
        {"{\"time\": 1, \"x_mm\": 1, \"y_mm\": 1, \"theta_rad\": 1}\n", "later"}}) {
    put_bytes(path_, line(99.0, 0.0) + "\n" + bad + line(101.0, 0.0));
    expect_named(input_error([&] { open(1); }), {"poses, line 3", named, "theta_rad"});
  }
  put_bytes(path_, std::string(100000, '1') + "\n");
  expect_named(input_error([&] { open(1); }), {"line 1", "longer"});
}

TEST_F(PosedSensorSource, WhatCannotBeReadIsRefused) {
  expect_named(input_error([&] { open(1); }), {"poses", "cannot be read"});
  std::filesystem::create_directory(path_);
  expect_named(input_error([&] { open(1); }), {"poses", "folder"});
}

TEST_F(PosedSensorSource, FifoIsReadAsItComes) {
  ASSERT_EQ(::mkfifo(path_.c_str(), 0600), 0);
  PosedSensor sensor = open(10, 1.0);
  sensor.start();
  // Nobody writes: the first frame is held back, then let go without a pose.
  EXPECT_FALSE(sensor.next(0ms));
  std::optional<Frame> first;
  for (int i = 0; i < 10 && !first; ++i) {
    first = sensor.next(1s);
  }
  ASSERT_TRUE(first);
  EXPECT_FALSE(first->T_robot_sensor);
  {
    std::ofstream writer(path_);
    writer << line(99.0, 1.0) << "nonsense\n" << line(98.0, 1.0) << line(100.5, 1.0) << std::flush;
    std::size_t posed = 0;
    while (!sensor.ended()) {
      if (auto frame = sensor.next(1s)) {
        posed += frame->T_robot_sensor ? 1 : 0;
      }
    }
    // Frames that were held as long as the first may have gone without as well.
    EXPECT_EQ(sensor.poses().frames, posed);
    EXPECT_EQ(sensor.poses().frames + sensor.poses().without, 10u);
  }
  EXPECT_EQ(sensor.poses().read, 2u);
  EXPECT_EQ(sensor.poses().refused, 2u);
  expect_named(sensor.poses().first_refused, {"poses, line 2", "JSON"});
}

}  // namespace palpate::posed_sensor_test
