// Frames that another program writes, line by line.

#include "streaming/line_sensor.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "model/printable.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::line_sensor_test {

using namespace std::chrono_literals;
using Values = std::vector<double>;

constexpr double now_s = 50.0;

/// The frames of lines for an array of three elements.
std::vector<Frame> frames_of(const std::vector<std::string>& lines) {
  FrameLines format(3);
  std::vector<Frame> frames;
  for (const std::string& line : lines) {
    auto read = format.read(line, now_s);
    if (const auto* problem = std::get_if<FrameLines::Problem>(&read)) {
      ADD_FAILURE() << line << ": " << problem->words;
    } else if (auto* frame = std::get_if<Frame>(&read)) {
      frames.push_back(std::move(*frame));
    }
  }
  return frames;
}

std::string problem_of(const std::vector<std::string>& lines) {
  FrameLines format(3);
  for (const std::string& line : lines) {
    const auto read = format.read(line, now_s);
    if (const auto* problem = std::get_if<FrameLines::Problem>(&read)) {
      return problem->words;
    }
  }
  return "";
}

TEST(FrameLines, AreReadInEveryForm) {
  const std::vector<std::vector<std::string>> forms = {
      {R"({"time": 7.5, "pressure": [1, 2.5, -3]})"},
      {R"({"pressure": [[1], [2.5, -3]], "time": 7.5, "note": "x"})"},
      {"7.5,1,2.5,-3"},
      {"7.5, 1, 2.5, -3,\r"},
      {"7.5;1;2.5;-3"},
      {"7.5\t1\t2.5\t-3"},
      {"  7.5 1   2.5 -3 "},
      {"\xef\xbb\xbftime,a,b,c", "7.5,1,2.5,-3"},
      {"a,time,lost_before,b,c,device_time", "1,7.5,0,2.5,-3,9"}};
  for (const auto& lines : forms) {
    const std::vector<Frame> frames = frames_of(lines);
    ASSERT_EQ(frames.size(), 1u) << lines.front();
    EXPECT_EQ(frames[0].host_time_s, 7.5) << lines.front();
    EXPECT_EQ(frames[0].values, (Values{1.0, 2.5, -3.0})) << lines.front();
    EXPECT_FALSE(frames[0].T_robot_sensor) << lines.front();
  }
}

TEST(FrameLines, TakeTheNanOfPython) {
  const std::vector<Frame> frames =
      frames_of({R"({"note": "no NaN \" NaN", "pressure": [NaN, 2, NaN], "time": 1})"});
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_TRUE(std::isnan(frames[0].values[0]) && std::isnan(frames[0].values[2]));
  EXPECT_EQ(frames[0].values[1], 2.0);
}

TEST(FrameLines, WithoutATimeAreOfNow) {
  for (const char* line : {"[1,2,3]", R"({"pressure": [1, 2, 3]})", "1,2,3", "1 2 3"}) {
    const std::vector<Frame> frames = frames_of({line});
    ASSERT_EQ(frames.size(), 1u) << line;
    EXPECT_EQ(frames[0].host_time_s, now_s) << line;
    EXPECT_EQ(frames[0].values, (Values{1.0, 2.0, 3.0})) << line;
  }
}

TEST(FrameLines, MayHoldPoses) {
  const std::vector<std::vector<std::string>> forms = {
      {R"({"pressure": [1, 2, 3], "x_mm": 4, "y_mm": 5, "theta_rad": 6})"},
      {"7.5,4,5,6,1,2,3"},
      {"theta_rad,p0,p1,p2,y_mm,x_mm", "6,1,2,3,5,4"}};
  for (const auto& lines : forms) {
    const std::vector<Frame> frames = frames_of(lines);
    ASSERT_EQ(frames.size(), 1u) << lines.front();
    ASSERT_TRUE(frames[0].T_robot_sensor) << lines.front();
    EXPECT_EQ(frames[0].T_robot_sensor->translation_mm, glm::dvec2(4.0, 5.0)) << lines.front();
    EXPECT_EQ(frames[0].T_robot_sensor->theta_rad, 6.0) << lines.front();
  }
  EXPECT_FALSE(frames_of({"7.5,,nan,,1,2,3"}).at(0).T_robot_sensor) << "an unknown pose";
}

TEST(FrameLines, MayHoldUnknownReadings) {
  for (const auto& lines : std::vector<std::vector<std::string>>{
           {R"({"pressure": [1, null, 3]})"}, {"1,,3"}, {"1,nan,3"}, {"1,inf,3"}, {"1 nan 3"}}) {
    const std::vector<Frame> frames = frames_of(lines);
    ASSERT_EQ(frames.size(), 1u) << lines.front();
    EXPECT_FALSE(is_known(frames[0].values[1])) << lines.front();
    EXPECT_EQ(frames[0].values[2], 3.0) << lines.front();
  }
  // The first line has no separator behind its last cell, so that the second one ends in an
  // unknown.
  EXPECT_TRUE(std::isnan(frames_of({"1,2,3", "4,5,"}).at(1).values[2]));
}

TEST(FrameLines, SayWhatIsWrong) {
  struct Case {
    std::vector<std::string> lines;
    std::vector<std::string> parts;
  };
  const std::vector<Case> cases = {
      {{R"({"pressure": [1, 2)"}, {"JSON"}},
      {{R"({"pressures": [1, 2, 3]})"}, {"'pressure'"}},
      {{R"({"pressure": [1, "2", 3]})"}, {"'pressure'", "numbers and null"}},
      {{R"({"pressure": [1, 2]})"}, {"2 readings", "3 elements"}},
      {{R"({"pressure": [1, 2, 3], "time": "now"})"}, {"'time'"}},
      {{R"({"pressure": [1, 2, 3], "x_mm": 1})"}, {"'y_mm'"}},
      {{"1,2"}, {"2 numbers", "3 elements"}},
      {{"1,2,3,4,5"}, {"5 numbers", "3 elements"}},
      {{"time,a,b"}, {"2 readings", "3 elements"}},
      {{"1,2,3", "1,2,3,4"}, {"4 cells", "first line 3"}},
      {{"1,2,3", "1,x,3"}, {"column 2 = 'x' is no number"}},
      {{"1,2,3", "1,\x1b[1m,3"}, {"column 2 is no number"}},
      {{"[[[1, 2, 3]]]"}, {"'pressure'", "numbers and null"}},
      {{"1,2,3,4", ",2,3,4"}, {"column 1", "no time"}},
      {{"7.5,1e300,5,6,1,2,3"}, {"1e+300", "1e9 mm"}}};
  for (const auto& [lines, parts] : cases) {
    for (const std::string& part : parts) {
      EXPECT_NE(problem_of(lines).find(part), std::string::npos) << problem_of(lines);
    }
  }
}

TEST(FrameLines, AreFramesOfTheArrayOrRefusedInOneShortLine) {
  const std::vector<std::string> forms = {
      R"({"time": 7.5, "pressure": [1, 2.5, null], "x_mm": 4, "y_mm": 5, "theta_rad": 6})",
      "[[1], [2.5, -3]]",
      "7.5,4,5,6,1,2,3",
      "1;nan;3;",
      "time,x_mm,a,b,c",
      " 1 2  3 4 "};
  std::mt19937 random(7);
  std::size_t frames = 0;
  for (int round = 0; round < 3000; ++round) {
    FrameLines format(3);
    for (int line = 0; line < 4; ++line) {
      std::string text = forms[random() % forms.size()];
      for (unsigned edits = random() % 3; edits > 0; --edits) {
        const std::size_t at = random() % text.size();
        text.replace(at, random() % 3, 1, static_cast<char>(random()));
      }
      if (text.find_first_not_of(" \t\r") == std::string::npos) {
        continue;  // LineReader gives no blank line
      }
      const auto read = format.read(text, now_s);
      if (const auto* problem = std::get_if<FrameLines::Problem>(&read)) {
        EXPECT_LT(problem->words.size(), 200u);
        EXPECT_TRUE(is_printable(problem->words)) << problem->words;
      } else if (const auto* frame = std::get_if<Frame>(&read)) {
        ++frames;
        EXPECT_EQ(frame->values.size(), 3u);
        EXPECT_TRUE(std::isfinite(frame->host_time_s)) << text;
        EXPECT_TRUE(!frame->T_robot_sensor || is_robot_pose(*frame->T_robot_sensor)) << text;
      }
    }
  }
  EXPECT_GT(frames, 2000u) << "too few lines are still frames";
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

  LineSensor open() {
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
  LineSensor sensor = open();
  send("1,2,3\n1,x,3\n1,2\n" + std::string(10'000, '1') + "\n1,y,3\n4,5,6\n7,8");
  end();
  EXPECT_EQ(sensor.next(0ms)->lost_before, 0u);
  EXPECT_EQ(sensor.next(0ms)->lost_before, 4u);
  EXPECT_FALSE(sensor.next(0ms));
  EXPECT_EQ(sensor.refused(), 5u);
  EXPECT_EQ(sensor.counters().lost, 5u);
  ASSERT_EQ(complaints_.size(), 2u);
  expect_named(complaints_[0], {"standard input, line 2: column 2 = 'x'",
                                "write {\"time\": s, \"pressure\": [3 numbers]}"});
  expect_named(complaints_[1], {"line 3: has 2 cells"});
  EXPECT_EQ(sensor.first_refused(), complaints_[0]);
}

TEST_F(LineSensorInput, LeavesOutWhatABoardPrintsAsItStarts) {
  LineSensor sensor = open();
  send(",3\nTactile board 1.2\na b c\n2 sensors found\n0.5,1,2,3\n0.6,4,5,6\n");
  EXPECT_EQ(sensor.next(0ms)->values, (Values{1.0, 2.0, 3.0}));
  EXPECT_EQ(sensor.next(0ms)->values, (Values{4.0, 5.0, 6.0}));
  EXPECT_EQ(sensor.refused(), 0u);
  ASSERT_EQ(complaints_.size(), 1u);
  expect_named(complaints_[0],
               {"standard input: 4 lines before the first frame are left out: ',3'"});
}

TEST_F(LineSensorInput, SaysWhereTimesAreInNoSeconds) {
  const std::pair<double, const char*> clocks[] = {
      {10.0, "milliseconds"}, {1e4, "microseconds"}, {1e7, "nanoseconds"}, {0.01, nullptr}};
  for (const auto& [step, unit] : clocks) {
    complaints_.clear();
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
  {
    LineSensor sensor = open();
    send("1,2,3\n");
    ASSERT_TRUE(sensor.next(0ms));
  }
  {
    LineSensor sensor = open();
    send("boot\n1,2\n1,2,3\n");
    expect_named(input_error([&] { sensor.next(0ms); }), {"standard input, line 2", "2 numbers"});
  }
  {
    LineSensor sensor = open();
    for (int i = 0; i < 101; ++i) {
      send("board is starting up\n");
    }
    expect_named(input_error([&] { sensor.next(0ms); }), {"standard input, line 101"});
  }
  LineSensor sensor = open();
  end();
  expect_named(input_error([&] { sensor.next(0ms); }), {"standard input", "first frame"});
}

}  // namespace palpate::line_sensor_test
