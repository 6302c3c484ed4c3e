// Robots that stamp poses wrongly, never stop or go on without a board.

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

class PoseSource : public testing::Test {
 protected:
  ~PoseSource() override { ::close(fifo_); }

  void make_fifo() {
    ASSERT_EQ(::mkfifo(path_.c_str(), 0600), 0);
    // For reading and writing it opens at once; a write to a full one returns.
    fifo_ = ::open(path_.c_str(), O_RDWR | O_NONBLOCK);
    ASSERT_GE(fifo_, 0);
  }

  // How many of the bytes fitted in.
  std::size_t send(const std::string& text) const {
    const ssize_t sent = ::write(fifo_, text.data(), text.size());
    return sent < 0 ? 0 : static_cast<std::size_t>(sent);
  }

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
  int fifo_ = -1;
  QueuedSensor::Board board_;
  std::vector<std::string> complaints_;
};

TEST_F(PoseSource, WrongStampsCostNoFrameItsPoseAndAreSaidAtOnce) {
  make_fifo();
  PosedSensor sensor = open();
  sensor.start();
  std::string text;
  for (int i = 0; i <= 100; ++i) {
    text += line(time_of(i), i);
    if (i == 20 || i == 70) {
      text += line(1000.0 * time_of(i), i);  // in milliseconds
    }
  }
  ASSERT_EQ(send(text), text.size());
  add_frames(0, 50);
  EXPECT_EQ(posed_frames(sensor), 50u);
  ASSERT_EQ(complaints_.size(), 1u) << "when it happens";
  expect_named(complaints_[0], {"poses ", "line 22", "1700000000200 s", "later", "theta_rad"});
  add_frames(50, 100);
  EXPECT_EQ(posed_frames(sensor), 50u);
  EXPECT_EQ(complaints_.size(), 1u) << "once";
  EXPECT_EQ(sensor.poses().read, 101u);
  EXPECT_EQ(sensor.poses().refused, 2u);
  EXPECT_EQ(sensor.poses().frames, 100u);
  EXPECT_EQ(sensor.poses().first_refused, complaints_[0].substr(6));
}

TEST_F(PoseSource, EveryKindOfFaultIsSaidOnce) {
  make_fifo();
  PosedSensor sensor = open();
  sensor.start();
  std::string text;
  for (int i = 0; i < 3; ++i) {
    text += "nonsense\n" + std::string(5000, ' ') + "\n{\"time\": 1}\n" +
            line(time_of(10 * i), 1.7e308) + line(time_of(10 * i), 1.0) +
            line(time_of(10 * i) - 30.0, 1.0) + line(time_of(10 * i + 1), 1.0);
  }
  for (int i = 0; i < 5; ++i) {
    text += line(time_of(i) - 3600.0, 1.0);
  }
  ASSERT_EQ(send(text), text.size());
  sensor.next(0ms);
  ASSERT_EQ(complaints_.size(), 6u);
  expect_named(complaints_[0], {"line 1", "JSON"});
  expect_named(complaints_[1], {"line 2", "longer"});
  expect_named(complaints_[2], {"line 3", "'x_mm'"});
  expect_named(complaints_[3], {"line 4", "1.7e+308", "1e9 mm"});
  expect_named(complaints_[4], {"line 6", "not later", "1699999970 s", "1700000000 s"});
  expect_named(complaints_[5], {"line 22", "clock"});
  EXPECT_EQ(sensor.poses().refused, 15u);
  EXPECT_EQ(sensor.poses().read, 11u);
}

// The poses of a clock that was set back join the track: none of their lines is refused.
TEST_F(PoseSource, AClockThatIsSetBackRefusesNoLine) {
  make_fifo();
  PosedSensor sensor = open();
  sensor.start();
  std::string text;
  for (const double step_s : {0.0, -3600.0, -7200.0}) {
    for (int i = 0; i < 5; ++i) {
      text += line(time_of(i) + step_s, 1.0);
    }
  }
  ASSERT_EQ(send(text), text.size());
  sensor.next(0ms);
  ASSERT_EQ(complaints_.size(), 1u) << "said once";
  expect_named(complaints_[0], {"line 6", "clock"});
  EXPECT_EQ(sensor.poses().read, 15u);
  EXPECT_EQ(sensor.poses().set_back, 2u);
  EXPECT_EQ(sensor.poses().refused, 0u);
  EXPECT_EQ(sensor.poses().first_refused, "");
  ASSERT_EQ(send("nonsense\n"), 9u);
  sensor.next(0ms);
  EXPECT_EQ(sensor.poses().refused, 1u);
  expect_named(sensor.poses().first_refused, {"line 16", "JSON"});
}

// As long as it may still come, which the clock decides after 0.2 s.
TEST_F(PoseSource, FrameWaitsForThePoseAfterIt) {
  make_fifo();
  PosedSensor sensor = open();
  sensor.start();
  send(line(time_of(0), 0.0));
  add_frames(0, 1);
  EXPECT_FALSE(sensor.next(0ms));
  send(line(time_of(1), 8.0));
  const std::optional<Frame> frame = sensor.next(0ms);
  ASSERT_TRUE(frame && frame->T_robot_sensor);
  // Times since 1970 are good to 2.4e-7 s, and 800 mm pass in a second.
  EXPECT_NEAR(frame->T_robot_sensor->translation_mm.x, 4.0, 1e-3);
}

TEST_F(PoseSource, FileWithAWrongStampNamesItsLine) {
  std::string text;
  for (int i = 0; i < 10; ++i) {
    text += line(i == 4 ? 1000.0 * time_of(i) : time_of(i), i);
  }
  put_bytes(path_, text);
  expect_named(input_error([&] { open(); }), {"poses, line 5", "1700000000040 s"});
  put_bytes(path_, line(time_of(0), 1.7e308));
  expect_named(input_error([&] { open(); }), {"poses, line 1", "1e9 mm"});
  put_bytes(path_, line(time_of(0), 1.0) + line(time_of(1), 1.0) + line(1.0, 1.0));
  expect_named(input_error([&] { open(); }), {"poses, line 3", "not later"});
  put_bytes(path_, line(time_of(0), 1.0) + line(time_of(1000), 1.0));
  EXPECT_EQ(open().poses().read, 2u) << "a pause before the last pose";
}

TEST_F(PoseSource, TableServesLikeLines) {
  std::string rows;
  std::string shuffled = "theta_rad, x_mm, time, note, y_mm\r\n";
  for (int i = 0; i <= 10; ++i) {
    rows += fmt::format("{},{},1,0.5\n", time_of(i), i);
    shuffled += fmt::format("0.5, {}, {}, up, 1\r\n", i, time_of(i));
  }
  for (const std::string& table : {"time,x_mm,y_mm,theta_rad\n" + rows, rows, shuffled}) {
    put_bytes(path_, table);
    PosedSensor sensor = open();
    sensor.start();
    add_frames(0, 10);
    for (int i = 0; i < 10; ++i) {
      const Pose pose = sensor.next(0ms)->T_robot_sensor.value();
      EXPECT_NEAR(pose.translation_mm.x, i + 0.5, 1e-4);  // of 1.7e9 s float64 resolves 2e-7
      EXPECT_EQ(pose.translation_mm.y, 1.0);
      EXPECT_EQ(pose.theta_rad, 0.5);
    }
    sensor.stop();
  }
  for (const auto& [table, words] :
       {std::pair{"time,x,y,theta\n", "line 1: names no column 'x_mm'"},
        {"1,2,3,4\n5,6,,8\n", "line 2: has no number 'y_mm'"},
        {"1,2,3,4\n1,2,3\n", "line 2: is no JSON object, and no row"},
        {"1,2,3,4\ntime,x_mm,y_mm,theta_rad\n", "line 2: has no number"}}) {
    put_bytes(path_, table);
    expect_named(input_error([&] { open(); }), {words, "or CSV with these columns"});
  }
}

TEST_F(PoseSource, FileServesEveryStart) {
  std::string text;
  for (int i = 0; i <= 100; ++i) {
    text += line(time_of(i), i);
  }
  put_bytes(path_, text);
  PosedSensor sensor = open();
  for (int run = 0; run < 3; ++run) {
    sensor.start();
    add_frames(0, 100);
    EXPECT_EQ(posed_frames(sensor), 100u) << run;
    EXPECT_EQ(sensor.poses().frames, 100u) << "since start()";
    EXPECT_EQ(sensor.poses().without, 0u);
    EXPECT_EQ(sensor.poses().read, 101u);
    sensor.stop();
    EXPECT_EQ(board_.starts, run + 1);
    EXPECT_EQ(board_.stops, run + 1);
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
  put_bytes(path_, "nonsense\n");
  input_error([&] { open(); });
  EXPECT_EQ(open_descriptors(), before);
}

// Neither lines that never end nor lines that never stop keep next() from returning.
TEST_F(PoseSource, AFloodIsReadInPieces) {
  PosedSensor zeros = open("/dev/zero");
  zeros.start();
  add_frames(0, 1);
  for (int i = 0; i < 100; ++i) {
    EXPECT_FALSE(zeros.next(0ms));
  }
  EXPECT_EQ(zeros.poses().read, 0u);

  make_fifo();
  PosedSensor sensor = open();
  sensor.start();
  std::string poses;
  for (int i = 0; poses.size() < (1 << 17); ++i) {
    poses += line(time_of(i), i);
  }
  ASSERT_GE(::fcntl(fifo_, F_SETPIPE_SZ, 1 << 17), 1 << 17);
  const std::size_t sent = send(poses);
  ASSERT_GT(sent, 100000u);
  sensor.next(0ms);
  const auto lines_in = [&](std::size_t bytes) {
    return static_cast<std::uint64_t>(
        std::count(poses.begin(), poses.begin() + static_cast<std::ptrdiff_t>(bytes), '\n'));
  };
  EXPECT_EQ(sensor.poses().read, lines_in(1 << 16)) << "64 KiB at once";
}

TEST_F(PoseSource, WhileTheBoardIsGoneASecondOfPosesIsKept) {
  make_fifo();
  board_.gone = true;
  PosedSensor sensor = open();
  sensor.start();
  constexpr int poses = 100000;  // more than may wait for a board that is there
  for (int i = 0; i < poses; i += 500) {
    std::string text;
    for (int k = i; k < i + 500; ++k) {
      text += line(time_of(k), k);
    }
    ASSERT_EQ(send(text), text.size()) << "the robot is not kept waiting";
    EXPECT_FALSE(sensor.next(0ms));
  }
  EXPECT_EQ(sensor.poses().read, static_cast<std::uint64_t>(poses));
  board_.gone = false;
  add_frames(poses - 200, poses - 1);
  // A frame of before that second has none; one that lies in it has.
  EXPECT_EQ(posed_frames(sensor), 100u);
}

TEST_F(PoseSource, PosesAheadOfASilentBoardWaitInTheFifo) {
  make_fifo();
  PosedSensor sensor = open();
  sensor.start();
  int sent = 0;
  for (; sent < 100000; sent += 500) {
    std::string text;
    for (int k = sent; k < sent + 500; ++k) {
      text += line(time_of(k), k);
    }
    if (send(text) != text.size()) {
      break;
    }
    EXPECT_FALSE(sensor.next(0ms));
  }
  EXPECT_LT(sent, 70000);
  EXPECT_GE(sensor.poses().read, 65536u);
  EXPECT_LT(sensor.poses().read, 65536u + 1000u);  // 64 KiB hold less than 1,000 poses
  add_frames(0, 60000);
  EXPECT_EQ(posed_frames(sensor), 60000u) << "none of them is lost";
}

}  // namespace palpate::pose_source_test
