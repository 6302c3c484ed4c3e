// `palpate live` on a terminal: picture, keys, Ctrl-C, windows of any size.

#include <algorithm>

#include "program.hpp"
#include "sample_files.hpp"

namespace palpate::live_terminal_test {

const std::map<std::string, std::string> utf8_colours{
    {"TERM", "xterm-256color"}, {"COLORTERM", "truecolor"}, {"LC_ALL", "C.UTF-8"}};

class LiveTerminal : public ProgramTest {
 protected:
  LiveTerminal() {
    write_map(folder_ / "A.map.h5", sample_map("A"));
    write_map(folder_ / "E.map.h5", sample_map("E"));
  }

  // Several times as fast as a robot, and without end.
  static std::vector<std::string> endless() {
    return {"live",   "--sensor", "simulate:E,rate=100,object=random,speed=10",
            "--maps", "A.map.h5", "E.map.h5",
            "--bins", "8x8x8"};
  }
};

const std::string ctrl_c = "\x03";
const std::string enter = "\033[?1049h\033[?25l";
const std::string leave = "\033[?25h\033[?1049l";

TEST_F(LiveTerminal, ShowsThePictureUntilCtrlC) {
  ProgramOnTerminal program(folder_.path(), endless(), utf8_colours);
  ASSERT_TRUE(program.shows(enter));
  ASSERT_TRUE(program.shows(" deg"));  // the pose in the robot frame
  ASSERT_TRUE(program.shows("truth: E at x "));
  ASSERT_TRUE(program.shows("unknown 1, 1 touches"));
  ASSERT_TRUE(program.shows("pressure, 0 to "));
  ASSERT_TRUE(program.shows("the array on the map of "));
  ASSERT_TRUE(program.shows("\033[38;2;"));
  ASSERT_TRUE(program.shows("identity"));
  ASSERT_TRUE(program.shows(" %"));
  program.type("r");
  ASSERT_TRUE(program.shows("unknown 2, 1 touches"));
  program.type(ctrl_c);
  const Outcome outcome = program.finish();
  EXPECT_EQ(outcome.status, 0) << outcome.out;
  const std::size_t left = outcome.out.rfind(leave);
  ASSERT_NE(left, std::string::npos) << "the terminal is not restored";
  EXPECT_EQ(outcome.out.find('\033', left + leave.size()), std::string::npos);
  const std::string after = outcome.out.substr(left + leave.size());
  EXPECT_NE(after.find(" touches, "), std::string::npos) << after;
  EXPECT_NE(after.find(" lost"), std::string::npos) << after;
  EXPECT_NE(after.find("from frame to estimate"), std::string::npos) << after;
  EXPECT_NE(after.find("theta "), std::string::npos) << after;
}

TEST_F(LiveTerminal, FollowsTheWindow) {
  ProgramOnTerminal program(folder_.path(), endless(), utf8_colours, 120, 40);
  ASSERT_TRUE(program.shows("pressure, 0 to "));
  // The last row has keys where there is room, and the smallest windows are drawn in all the same.
  ASSERT_TRUE(program.shows("\r\nr: next unknown   Ctrl-C: end\033[K\033[J"));
  for (const auto& [columns, rows] : {std::pair{1, 1}, {3, 2}, {30, 6}, {500, 3}}) {
    program.resize(columns, rows);
    // Home, then one line less than rows of line ends.
    ASSERT_TRUE(program.shows("\033[H"));
  }
  program.resize(80, 24);
  ASSERT_TRUE(program.shows("pressure, 0 to "));
  program.type(ctrl_c);
  EXPECT_EQ(program.finish().status, 0);
}

TEST_F(LiveTerminal, PrintsPicturesWhereTheCursorCannotMove) {
  ProgramOnTerminal program(folder_.path(),
                            {"live", "--sensor", "simulate:E,touches=1,speed=4", "--maps",
                             "A.map.h5", "E.map.h5", "--bins", "8x8x8"},
                            {{"TERM", "dumb"}});
  const Outcome outcome = program.finish();
  EXPECT_EQ(outcome.status, 0) << outcome.out;
  EXPECT_EQ(outcome.out.find('\033'), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("identity"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("@@"), std::string::npos) << outcome.out;
  EXPECT_TRUE(std::all_of(outcome.out.begin(), outcome.out.end(),
                          [](unsigned char c) { return c < 0x7F; }));
}

// Standard output is the program's that reads it: nothing but JSON, though it is a terminal.
TEST_F(LiveTerminal, KeepsJsonApart) {
  ProgramOnTerminal program(folder_.path(),
                            {"live", "--sensor", "simulate:E,touches=1,speed=max", "--maps",
                             "A.map.h5", "E.map.h5", "--bins", "8x8x8", "--json", "-"},
                            utf8_colours);
  const Outcome outcome = program.finish();
  EXPECT_EQ(outcome.status, 0) << outcome.out;
  EXPECT_EQ(outcome.out.find('\033'), std::string::npos) << outcome.out;
  EXPECT_EQ(nlohmann::json::parse(outcome.out.substr(0, outcome.out.find('\n'))).at("touch"), 0u);
}

}  // namespace palpate::live_terminal_test
