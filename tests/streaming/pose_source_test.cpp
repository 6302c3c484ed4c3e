// Poses from files and from robots, which stamp them wrongly, never stop or go on without a board.

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <deque>
#include <filesystem>
#include <iterator>
#include <vector>

#include "palpate/pose_track.hpp"
#include "support/child_process.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::pose_source_test {

using namespace std::chrono_literals;

// The time of a pose; poses are 10 ms apart.
double time_of(int i) { return 1.7e9 + 0.01 * i; }

// A board whose frames the test hands over; none ever makes next() wait.
class QueuedSensor : public Sensor {
 public:
  struct Board {
    std::deque<Frame> frames;
    bool gone = false;
    bool ended = false;
    int starts = 0;
    int stops = 0;
  };

  explicit QueuedSensor(Board& board) : board_(board) { description_.elements_mm = {{0.0, 0.0}}; }
  const SensorDescription& description() const override { return description_; }
  void start() override { ++board_.starts; }
  std::optional<Frame> next(std::chrono::milliseconds) override {
    if (board_.frames.empty()) {
      return {};
    }
    Frame frame = std::move(board_.frames.front());
    board_.frames.pop_front();
    return frame;
  }
  bool ended() const override { return board_.ended && board_.frames.empty(); }
  bool gone() const override { return board_.gone; }
  void stop() override { ++board_.stops; }
  SensorCounters counters() const override { return {}; }

 private:
  Board& board_;
  SensorDescription description_;
};

std::string line(double time_s, double x_mm) {
  return fmt::format("{{\"time\": {}, \"x_mm\": {}, \"y_mm\": 1, \"theta_rad\": 0.5}}\n", time_s,
                     x_mm);
}

// The poses [begin, end), x = their index.
std::string lines(int begin, int end, double ahead_s = 0.0) {
  std::string text;
  for (int i = begin; i < end; ++i) {
    text += line(time_of(i) + ahead_s, i);
  }
  return text;
}

class PoseSource : public testing::Test {
 protected:
  PosedSensor open(const std::string& poses) {
    return PosedSensor(std::make_unique<QueuedSensor>(board_), poses, 0.1,
                       [this](const std::string& text) { complaints_.push_back(text); });
  }
  PosedSensor open() { return open(path_.string()); }

  void add_frames(int begin, int end) {
    for (int i = begin; i < end; ++i) {
      board_.frames.push_back({.host_time_s = time_of(i) + 0.005, .values = {0.0}});
    }
  }

  // How many of the frames that the sensor has without waiting have a pose.
  static std::size_t posed_frames(PosedSensor& sensor) {
    std::size_t posed = 0;
    while (auto frame = sensor.next(0ms)) {
      posed += frame->T_robot_sensor ? 1 : 0;
    }
    return posed;
  }

  ScratchFolder folder_;
  std::filesystem::path path_ = folder_ / "poses";
  QueuedSensor::Board board_;
  std::vector<std::string> complaints_;
};

// FrameLines.AreReadInEveryForm has what its lines may be.
TEST_F(PoseSource, FileServesEveryStart) {
  std::string text = "\n" + lines(0, 51);
  for (const bool ends : {true, false}) {
    SCOPED_TRACE(ends);
    text.resize(text.size() - (ends ? 0 : 1));
    put_bytes(path_, text);
    board_ = {};
    PosedSensor sensor = open();
    for (int run = 1; run <= 2; ++run) {
      sensor.start();
      add_frames(0, 100);
      EXPECT_EQ(posed_frames(sensor), 50u);
      EXPECT_EQ(sensor.poses().read, 51u);
      EXPECT_EQ(sensor.poses().refused, 0u);
      EXPECT_EQ(sensor.poses().frames, 50u) << "since start()";
      EXPECT_EQ(sensor.poses().without, 50u);
      sensor.stop();
      EXPECT_EQ(board_.starts, run);
      EXPECT_EQ(board_.stops, run);
    }
  }
}

TEST_F(PoseSource, IsClosedWithTheSensor) {
  const auto open_descriptors = [] {
    const std::filesystem::directory_iterator list("/proc/self/fd");
    return std::distance(begin(list), end(list));
  };
  put_bytes(path_, line(time_of(0), 1.0));
  const auto before = open_descriptors();
  {
    const PosedSensor sensor = open();
    EXPECT_EQ(open_descriptors(), before + 1);
  }
  EXPECT_EQ(open_descriptors(), before);
  // A daemon has closed its standard input; the number 0 does not make it the file of poses.
  const int status = status_of([&] {
    ::close(STDIN_FILENO);
    open();
    EXPECT_LT(::fcntl(STDIN_FILENO, F_GETFD), 0);
  });
  EXPECT_EQ(status, 0);
  put_bytes(path_, "nonsense\n");
  input_error([&] { open(); });
  EXPECT_EQ(open_descriptors(), before);
}

TEST_F(PoseSource, FileWithABadLineIsRefusedByNumber) {
  const std::string two = lines(0, 1) + "\n";
  const std::pair<std::string, const char*> files[] = {
      {two + "nonsense\n" + lines(2, 3), "line 3: is no JSON object"},
      {two + "{\"time\": 1}\n", "line 3: has no number 'x_mm'"},
      {two + "{\"x_mm\": 1, \"y_mm\": 1, \"theta_rad\": 1}\n", "line 3: has no number 'time'"},
      {two + "{\"time\": 1, \"x_mm\": 1, \"y_mm\": 1e999, \"theta_rad\": 1}\n", "line 3"},
      {lines(0, 2) + line(1.0, 1.0), "line 3: time = 1 s is not later"},
      {lines(0, 4) + line(1000.0 * time_of(4), 4) + lines(5, 10), "line 5: time = 1700000000040 s"},
      {line(time_of(0), 1.7e308), "line 1: x_mm = 1.7e+308"},
      {std::string(100000, '1') + "\n", "line 1: is longer"},
      {"time,x,y,theta\n", "line 1: names no column 'x_mm'"},
      {"1,2,3,4\n5,6,,8\n", "line 2: has no number 'y_mm'"},
      {"1,2,3,4\n1,2,3\n", "line 2: is no JSON object, and no row"},
      {"1,2,3,4\ntime,x_mm,y_mm,theta_rad\n", "line 2: has no number"}};
  for (const auto& [text, named] : files) {
    put_bytes(path_, text);
    expect_named(input_error([&] { open(); }), {"poses, ", named});
  }
  put_bytes(path_, line(time_of(0), 1.0) + line(time_of(1000), 1.0));
  EXPECT_EQ(open().poses().read, 2u) << "a pause before the last pose";
}

TEST_F(PoseSource, WhatCannotBeReadIsRefused) {
  input_error([&] { PosedSensor(nullptr, "-"); });
  expect_named(input_error([&] { open(); }), {"poses", "cannot be read"});
  std::filesystem::create_directory(path_);
  expect_named(input_error([&] { open(); }), {"poses", "folder"});
}

/// A robot that the test plays, and the sensor that has started with it.
class PoseFifo : public PoseSource {
 protected:
  PoseFifo() {
    EXPECT_EQ(::mkfifo(path_.c_str(), 0600), 0);
    // For reading and writing it opens at once; a write to a full one returns.
    fifo_ = ::open(path_.c_str(), O_RDWR | O_NONBLOCK);
    sensor_.emplace(std::make_unique<QueuedSensor>(board_), path_.string(), 0.1,
                    [this](const std::string& text) { complaints_.push_back(text); });
    sensor_->start();
  }
  ~PoseFifo() override { ::close(fifo_); }

  // How many of the bytes fitted in.
  std::size_t send(const std::string& text) const {
    const ssize_t sent = ::write(fifo_, text.data(), text.size());
    return sent < 0 ? 0 : static_cast<std::size_t>(sent);
  }
  // Sends lines, of which the sensor takes notice.
  void tell(const std::string& text) {
    ASSERT_EQ(send(text), text.size());
    EXPECT_FALSE(sensor_->next(0ms));
  }

  int fifo_ = -1;
  std::optional<PosedSensor> sensor_;
};

// The poses of a clock that was set back join the track: none of their lines is refused.
TEST_F(PoseFifo, EveryKindOfFaultIsSaidOnceAndAClockThatIsSetBackRefusesNoLine) {
  constexpr double back_s = -7200.0;
  std::string text = lines(0, 5) + lines(0, 5, -3600.0) + lines(0, 5, back_s);
  for (int i = 10; i < 40; i += 10) {
    const double time_s = time_of(i) + back_s;
    text += "nonsense\n" + std::string(5000, ' ') + "\n{\"time\": 1}\n" + line(time_s, 1.7e308) +
            line(time_s, 1.0) + line(time_s - 30.0, 1.0) + line(time_of(i + 1) + back_s, 1.0);
  }
  tell(text);
  ASSERT_EQ(complaints_.size(), 6u);
  expect_named(complaints_[0], {"line 6", "clock"});
  expect_named(complaints_[1], {"line 16", "JSON"});
  expect_named(complaints_[2], {"line 17", "longer"});
  expect_named(complaints_[3], {"line 18", "'x_mm'"});
  expect_named(complaints_[4], {"line 19", "1.7e+308"});
  expect_named(complaints_[5], {"line 21", "not later", "1699992770.1 s", "1699992800.1 s"});
  EXPECT_EQ("poses " + sensor_->poses().first_refused, complaints_[1]);
  EXPECT_EQ(sensor_->poses().refused, 15u);
  EXPECT_EQ(sensor_->poses().set_back, 2u);
  EXPECT_EQ(sensor_->poses().read, 21u);
}

TEST_F(PoseFifo, AStampThatIsFarLaterCostsNoFrameItsPoseAndIsSaidAtOnce) {
  tell(lines(0, 21) + line(1000.0 * time_of(20), 20) + lines(21, 71));
  ASSERT_EQ(complaints_.size(), 1u) << "when it happens";
  expect_named(complaints_[0], {"line 22", "1700000000200 s", "far later than the poses around"});
  tell(line(1000.0 * time_of(70), 70) + lines(71, 101));
  EXPECT_EQ(complaints_.size(), 1u) << "once";
  add_frames(0, 100);
  EXPECT_EQ(posed_frames(*sensor_), 100u);
  EXPECT_EQ(sensor_->poses().read, 101u);
  EXPECT_EQ(sensor_->poses().refused, 2u);
  EXPECT_EQ("poses " + sensor_->poses().first_refused, complaints_[0]);
}

// A refused line decides neither the columns nor the separator of the others.
TEST_F(PoseFifo, WordsBeforeThePosesAreRefusedAlone) {
  tell("the robot is ready now\n1 robot is ready\n1.7e9,1,2,0.5\n");
  EXPECT_EQ(sensor_->poses().refused, 2u);
  EXPECT_EQ(sensor_->poses().read, 1u);
}

// As long as it may still come, which the clock decides after 0.2 s.
TEST_F(PoseFifo, FrameWaitsForThePoseAfterItForAMoment) {
  add_frames(0, 1);
  tell(line(time_of(0), 0.0));
  send(line(time_of(1), 8.0));
  const std::optional<Frame> frame = sensor_->next(0ms);
  ASSERT_TRUE(frame && frame->T_robot_sensor);
  // Times since 1970 are good to 2.4e-7 s, and 800 mm pass in a second.
  EXPECT_NEAR(frame->T_robot_sensor->translation_mm.x, 4.0, 1e-3);
  add_frames(5, 6);
  EXPECT_FALSE(sensor_->next(0ms));
  std::optional<Frame> let_go;
  while (!let_go) {
    let_go = sensor_->next(1s);
  }
  EXPECT_FALSE(let_go->T_robot_sensor);
  EXPECT_EQ(sensor_->poses().without, 1u);
}

TEST_F(PoseFifo, OutlivesItsWriters) {
  for (const int i : {0, 1}) {
    ::close(fifo_);
    EXPECT_FALSE(sensor_->next(0ms)) << "nobody writes";
    fifo_ = ::open(path_.c_str(), O_WRONLY | O_NONBLOCK);
    tell(lines(i, i + 1));
  }
  EXPECT_EQ(sensor_->poses().read, 2u);
  add_frames(0, 1);
  EXPECT_EQ(posed_frames(*sensor_), 1u);
}

// Neither lines that never end nor lines that never stop keep next() from returning.
TEST_F(PoseFifo, AFloodIsReadInPieces) {
  ASSERT_GE(::fcntl(fifo_, F_SETPIPE_SZ, 1 << 17), 1 << 17);
  const std::string poses = lines(0, 2000);
  ASSERT_GT(send(poses), 100000u);
  sensor_->next(0ms);
  EXPECT_EQ(sensor_->poses().read,
            static_cast<std::uint64_t>(std::count(poses.begin(), poses.begin() + (1 << 16), '\n')))
      << "64 KiB at once";
  PosedSensor zeros = open("/dev/zero");
  zeros.start();
  add_frames(0, 1);
  for (int i = 0; i < 100; ++i) {
    EXPECT_FALSE(zeros.next(0ms));
  }
  EXPECT_EQ(zeros.poses().read, 0u);
}

TEST_F(PoseFifo, WhileTheBoardIsGoneASecondOfPosesIsKept) {
  board_.gone = true;
  constexpr int poses = 100000;  // more than may wait for a board that is there
  for (int i = 0; i < poses; i += 500) {
    tell(lines(i, i + 500));
  }
  EXPECT_EQ(sensor_->poses().read, static_cast<std::uint64_t>(poses));
  board_.gone = false;
  add_frames(poses - 200, poses - 1);
  // A frame of before that second has none; one that lies in it has.
  EXPECT_EQ(posed_frames(*sensor_), 100u);
}

TEST_F(PoseFifo, PosesAheadOfASilentBoardWaitInIt) {
  int sent = 0;
  for (; sent < 100000; sent += 500) {
    const std::string text = lines(sent, sent + 500);
    if (send(text) != text.size()) {
      break;
    }
    EXPECT_FALSE(sensor_->next(0ms));
  }
  EXPECT_LT(sent, 70000);
  EXPECT_GE(sensor_->poses().read, 65536u);
  EXPECT_LT(sensor_->poses().read, 65536u + 1000u);  // 64 KiB hold less than 1,000 poses
  add_frames(0, 60000);
  EXPECT_EQ(posed_frames(*sensor_), 60000u) << "none of them is lost";
}

}  // namespace palpate::pose_source_test
