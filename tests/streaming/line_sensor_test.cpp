// Frames that another program writes, line by line.

#include "streaming/line_sensor.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <string>
#include <vector>

#include "support/errors.hpp"
#include "support/host_locale.hpp"
#include "support/limits.hpp"

namespace palpate::line_sensor_test {

using namespace std::chrono_literals;
using Values = std::vector<double>;

constexpr double now_s = 50.0;

using Lines = std::vector<std::string>;

/// What an array of so many elements makes of the last of these lines; 0: poses alone.
auto read_last(const Lines& lines, std::size_t elements = 3) {
  FrameLines format(elements);
  for (std::size_t i = 0; i + 1 < lines.size(); ++i) {
    EXPECT_FALSE(std::holds_alternative<FrameLines::Flaw>(format.read(lines[i], now_s)));
  }
  return format.read(lines.back(), now_s);
}

struct FrameCase {
  Lines lines;
  Values values = {1.0, 2.5, -3.0};
  double time_s = 7.5;
  std::optional<Pose> T_robot_sensor = {};
};

TEST(FrameLines, AreReadInEveryForm) {
  const Pose pose{{4.0, 5.0}, 6.0};
  const FrameCase cases[] = {
      {{R"({"time": 7.5, "pressure": [1, 2.5, -3]})"}},
      {{R"({"pressure": [[1], [2.5, -3]], "time": 7.5, "note": "x"})"}},
      {{"7.5,1,2.5,-3"}},
      {{"7.5, 1, 2.5, -3,\r"}},
      {{"7.5;1;2.5;-3"}},
      {{"7.5\t1\t2.5\t-3"}},
      {{"  7.5 1   2.5 -3 "}},
      {{"\xef\xbb\xbftime,a,b,c", "7.5,1,2.5,-3"}},
      {{"a,time,lost_before,b,c,device_time", "1,7.5,0,2.5,-3,9"}},
      // Python's NaN, and others in the place of a reading
      {{R"({"note": "no NaN \" NaN", "pressure": [NaN, 2, NaN], "time": 7.5})"}, {nan, 2, nan}},
      {{R"({"pressure": [Infinity, 2, -Infinity], "time": 7.5})"}, {nan, 2, nan}},
      {{R"({"pressure": [1, null, 3], "time": 7.5})"}, {1, nan, 3}},
      {{"7.5,1,,3"}, {1, nan, 3}},
      {{"7.5,1,nan,3"}, {1, nan, 3}},
      {{"7.5,1,inf,3"}, {1, nan, 3}},
      // The first line has no separator behind its last cell: the second ends in an Unknown.
      {{"1,2,3", "4,5,"}, {4, 5, nan}, now_s},
      {{"7.5,1,2,"}, {7.5, 1, 2}, now_s},
      {{"1.7e9,1,2,"}, {1, 2, nan}, 1.7e9},
      {{"1.7e9,4,5,6,1,2,"}, {1, 2, nan}, 1.7e9, pose},
      // Without a time they are of now.
      {{"[1,2,3]"}, {1, 2, 3}, now_s},
      {{"1,2,3"}, {1, 2, 3}, now_s},
      // With poses, and with one that is not known
      {{R"({"pressure": [1,2,3], "x_mm": 4, "y_mm": 5, "theta_rad": 6})"}, {1, 2, 3}, now_s, pose},
      {{"7.5,4,5,6,1,2,3"}, {1, 2, 3}, 7.5, pose},
      {{"theta_rad,p0,p1,p2,y_mm,x_mm", "6,1,2,3,5,4"}, {1, 2, 3}, now_s, pose},
      {{"7.5,,nan,,1,2,3"}, {1, 2, 3}},
      // Poses alone, with what else a robot writes
      {{R"({"time": 7.5, "x_mm": 4, "y_mm": 5, "theta_rad": 6})"}, {}, 7.5, pose},
      {{"time,x_mm,y_mm,theta_rad", "7.5,4,5,6"}, {}, 7.5, pose},
      {{"theta_rad, x_mm, time, note, y_mm\r", "6, 4, 7.5, up, 5\r"}, {}, 7.5, pose},
      {{"7.5,4,5,6"}, {}, 7.5, pose},
      {{"7.5,4,5,6,up; or\tdown"}, {}, 7.5, pose},
      {{"time\tx_mm\ty_mm\ttheta_rad", "7.5\t4\t5\t6\tup, or, else"}, {}, 7.5, pose}};
  const HostLocale locale;  // of a program whose numbers have decimal commas
  for (const FrameCase& row : cases) {
    SCOPED_TRACE(row.lines.back());
    const auto read = read_last(row.lines, row.values.size());
    const auto* frame = std::get_if<Frame>(&read);
    ASSERT_NE(frame, nullptr);
    EXPECT_EQ(frame->host_time_s, row.time_s);
    ASSERT_EQ(frame->values.size(), row.values.size());
    for (std::size_t k = 0; k < row.values.size(); ++k) {
      EXPECT_EQ(is_known(frame->values[k]), is_known(row.values[k])) << k;
      EXPECT_TRUE(!is_known(row.values[k]) || frame->values[k] == row.values[k]) << k;
    }
    ASSERT_EQ(frame->T_robot_sensor.has_value(), row.T_robot_sensor.has_value());
    if (row.T_robot_sensor) {
      EXPECT_EQ(frame->T_robot_sensor->translation_mm, row.T_robot_sensor->translation_mm);
      EXPECT_EQ(frame->T_robot_sensor->theta_rad, row.T_robot_sensor->theta_rad);
    }
  }
}

TEST(FrameLines, SayWhatIsWrong) {
  const std::pair<Lines, const char*> cases[] = {
      {{R"({"pressure": [1, 2)"}, "no whole JSON"},
      {{R"({"pressures": [1, 2, 3]})"}, "no list 'pressure'"},
      {{R"({"pressure": [1, "2", 3]})"}, "'pressure' holds something else"},
      {{"[[[1, 2, 3]]]"}, "'pressure' holds something else"},
      {{R"({"pressure": [1, 2]})"}, "has 2 readings for an array of 3 elements"},
      {{R"({"pressure": [1, 2, 3], "time": "now"})"}, "'time' is no number"},
      {{R"({"pressure": [1, 2, 3], "x_mm": 1})"}, "has no number 'y_mm'"},
      {{"1,2"}, "has 2 numbers for an array of 3 elements"},
      {{"1,2,3,4,5"}, "has 5 numbers for an array of 3 elements"},
      {{"time,a,b"}, "names 2 readings for an array of 3 elements"},
      {{"1,2,3", "1,2,3,4"}, "has 4 cells, the first line 3"},
      {{"1,2,3", "1,x,3"}, "column 2 = 'x' is no number"},
      {{"1,2,3", "1,\x1b[1m,3"}, "column 2 is no number"},
      {{"1,2,3", "1," + std::string(61, 'x') + ",3"}, "column 2 is no number"},
      {{"1,2,3,4", ",2,3,4"}, "column 1 = '' is no time"},
      {{"1,2,3,4", "inf,2,3,4"}, "column 1 = 'inf' is no time"},
      {{"7.5,1e300,5,6,1,2,3"}, "x_mm = 1e+300"}};
  for (const auto& [lines, words] : cases) {
    const auto read = read_last(lines);
    const auto* flaw = std::get_if<FrameLines::Flaw>(&read);
    ASSERT_NE(flaw, nullptr) << words;
    expect_named(flaw->words, {words});
  }
}

/// Standard input is what the test writes.
class LineSensorInput : public testing::Test {
 protected:
  LineSensorInput() : before_(::dup(STDIN_FILENO)) {
    int ends[2];
    EXPECT_EQ(::pipe(ends), 0);
    ::dup2(ends[0], STDIN_FILENO);
    ::close(ends[0]);
    writer_ = ends[1];
  }
  ~LineSensorInput() override {
    end();
    ::dup2(before_, STDIN_FILENO);
    ::close(before_);
  }

  void send(const std::string& text) const {
    ASSERT_EQ(::write(writer_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  void end() {
    if (writer_ >= 0) {
      ::close(writer_);
    }
    writer_ = -1;
  }

  LineSensor open(const std::string& text = "") {
    complaints_.clear();
    send(text);
    return LineSensor({.name = "", .elements_mm = {{0.0, 0.0}, {1.0, 0.0}, {2.0, 0.0}}},
                      [this](const std::string& text) { complaints_.push_back(text); });
  }

  int before_;
  int writer_ = -1;
  std::vector<std::string> complaints_;
};

TEST_F(LineSensorInput, GivesAFrameOnceItsLineIsWhole) {
  LineSensor sensor = open();
  sensor.start();
  EXPECT_FALSE(sensor.next(0ms)) << "a silent program";
  send("[1, 2,");
  EXPECT_FALSE(sensor.next(1ms)) << "a part of a line";
  send(" 3]\n\n[4, 5, 6]\n[7, 8");
  EXPECT_EQ(sensor.next(0ms)->values, (Values{1.0, 2.0, 3.0}));
  EXPECT_EQ(sensor.next(0ms)->values, (Values{4.0, 5.0, 6.0}));
  EXPECT_FALSE(sensor.next(0ms));
  EXPECT_FALSE(sensor.ended());
  send(", 9]");
  end();
  EXPECT_EQ(sensor.next(0ms)->values, (Values{7.0, 8.0, 9.0})) << "a last line needs no end";
  EXPECT_TRUE(sensor.ended());
  EXPECT_FALSE(sensor.next(0ms));
  EXPECT_EQ(sensor.counters().frames, 3u);
  EXPECT_EQ(sensor.counters().lost, 0u);
  EXPECT_TRUE(complaints_.empty());
}

// next() comes back in time although there is always something to read.
TEST_F(LineSensorInput, ReturnsWhileALineNeverEnds) {
  const int zeros = ::open("/dev/zero", O_RDONLY);
  ::dup2(zeros, STDIN_FILENO);
  ::close(zeros);
  LineSensor sensor = open();
  EXPECT_FALSE(sensor.next(0ms));
  EXPECT_FALSE(sensor.next(2ms));
  EXPECT_FALSE(sensor.ended());
}

TEST_F(LineSensorInput, SkipsRefusedLinesAndSaysEachKindOnce) {
  LineSensor sensor =
      open("1,2,3\n1,x,3\n1,2\n" + std::string(10'000, '1') + "\n1,y,3\n4,5,6\n7,8");
  end();
  EXPECT_EQ(sensor.next(0ms)->lost_before, 0u);
  EXPECT_EQ(sensor.next(0ms)->lost_before, 4u);
  EXPECT_FALSE(sensor.next(0ms));
  EXPECT_EQ(sensor.refused(), 5u);
  EXPECT_EQ(sensor.counters().lost, 5u);
  ASSERT_EQ(complaints_.size(), 3u);
  expect_named(complaints_[0], {"standard input, line 2: column 2 = 'x'", "[3 numbers]"});
  expect_named(complaints_[1], {"line 3: has 2 cells"});
  expect_named(complaints_[2], {"line 4: is longer than any frame"});
  EXPECT_EQ(sensor.first_refused(), complaints_[0]);
}

TEST_F(LineSensorInput, LeavesOutWhatABoardPrintsAsItStarts) {
  LineSensor sensor = open(",3\nTactile board 1.2\na b c\n2 sensors found\n0.5,1,2,3\n0.6,4,5,6\n");
  EXPECT_EQ(sensor.next(0ms)->values, (Values{1.0, 2.0, 3.0}));
  EXPECT_EQ(sensor.next(0ms)->values, (Values{4.0, 5.0, 6.0}));
  EXPECT_EQ(sensor.refused(), 0u);
  ASSERT_EQ(complaints_.size(), 1u);
  expect_named(complaints_[0], {"standard input: 4 lines before the first frame", ": ',3'"});
}

TEST_F(LineSensorInput, SaysWhereTimesAreInNoSeconds) {
  const std::pair<double, const char*> clocks[] = {{10.0, "milliseconds"},
                                                   {1e4, "microseconds"},
                                                   {1e7, "nanoseconds"},
                                                   {0.01, nullptr},
                                                   {1.0, nullptr}};
  for (const auto& [step, unit] : clocks) {
    LineSensor sensor = open();
    for (int i = 0; i < 30; ++i) {
      send(fmt::format("{},1,2,3\n", 5.0 + step * i));
      ASSERT_TRUE(sensor.next(0ms));
    }
    ASSERT_EQ(complaints_.size(), unit == nullptr ? 0u : 1u) << step;
    if (unit != nullptr) {
      expect_named(complaints_[0], {"s apart by their times, which look like ", unit});
    }
  }
}

TEST_F(LineSensorInput, EndsWithAnErrorWithoutAFrame) {
  EXPECT_TRUE(open("1,2,3\n").next(0ms));
  std::string lines;
  for (int i = 0; i < 101; ++i) {
    lines += "board is starting up\n";
  }
  for (const auto& [text, place] :
       {std::pair<std::string, const char*>{"boot\n1,2\n1,2,3\n", "line 2: has 2 numbers"},
        {"time,x_m,y_m,yaw,a,b,c\n0.5,1,2,3,4,5,6\n", "line 1: names 6 readings"},
        {"boot\na,b,c,d\n0.5,1,2,3\n", "line 2: "},
        {lines, "line 101: "}}) {
    LineSensor sensor = open(text);
    expect_named(input_error([&] { sensor.next(0ms); }), {"standard input, ", place});
  }
  LineSensor sensor = open();
  end();
  expect_named(input_error([&] { sensor.next(0ms); }), {"standard input ended before"});
}

}  // namespace palpate::line_sensor_test
