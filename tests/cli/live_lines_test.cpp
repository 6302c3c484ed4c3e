// `palpate live` on frames that another program writes to standard input.

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "live_command.hpp"

namespace palpate::live_lines_test {

using Arguments = std::vector<std::string>;
using LiveLines = LiveTest;

// The frames of a recording, as another program writes them, are those of its replay.
TEST_F(LiveLines, AreTheFramesOfAReplay) {
  done({"record", "--sensor", unknown_e, "-o", "frames.h5"});
  const auto expected = records_of("replay:frames.h5,speed=max");
  const Recording frames = read_recording(folder_ / "frames.h5");
  std::string json;
  std::string csv;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Touch frame = frames.touch(i);
    const Pose& pose = frame.T_robot_sensor;
    const std::string readings = fmt::format("{}", fmt::join(frame.pressure, ","));
    json += fmt::format(
        "{{\"time\": {:.17g}, \"pressure\": [{}], \"x_mm\": {}, \"y_mm\": {}, \"theta_rad\": "
        "{}}}\n",
        frames.time_s[i], readings, pose.translation_mm.x, pose.translation_mm.y, pose.theta_rad);
    csv += fmt::format("{:.17g},{},{},{},{}\n", frames.time_s[i], pose.translation_mm.x,
                       pose.translation_mm.y, pose.theta_rad, readings);
    if (i == 300) {
      csv += "cut off, 1\n";
    }
  }
  std::string array = "x,y,baseline\n";
  for (std::size_t k = 0; k < frames.elements(); ++k) {
    array += fmt::format("{},{},{}\n", frames.elements_mm[k].x, frames.elements_mm[k].y,
                         frames.baseline[k]);
  }
  put_bytes(folder_ / "array.csv", array);
  const Arguments more{"--array", "array.csv", "--json", "live.jsonl"};
  for (const std::string& lines : {json, csv}) {
    put_bytes(folder_ / "lines", lines);
    const Outcome outcome = palpate(live("-", more), {.standard_input = folder_ / "lines"});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const auto records = parsed(bytes_of(folder_ / "live.jsonl"));
    ASSERT_EQ(records.size(), expected.size());
    for (std::size_t i = 0; i < records.size(); ++i) {
      for (const char* key : {"identity", "mode", "time", "pose"}) {
        EXPECT_EQ(records[i].at(key), expected[i].at(key)) << key << " after touch " << i;
      }
    }
  }
  const Outcome outcome =
      palpate({"record", "--sensor", "-", "--array", "6:6:1.9", "-o", "again.h5"},
              {.standard_input = folder_ / "lines"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  expect_named(outcome.err,
               {"standard input, line 302: has 2 cells", "1 lines of frames were skipped"});
  const Recording again = read_recording(folder_ / "again.h5");
  ASSERT_EQ(again.size(), frames.size());
  EXPECT_EQ(again.pressure, frames.pressure);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(again.T_robot_sensor[i].translation_mm, frames.T_robot_sensor[i].translation_mm);
    EXPECT_EQ(again.T_robot_sensor[i].theta_rad, frames.T_robot_sensor[i].theta_rad);
  }
  EXPECT_EQ(again.time_s, frames.time_s);
}

TEST_F(LiveLines, AreRefusedWhereTheyCannotBeRead) {
  expect_refused(live("-"), {"--array", "COLUMNS:ROWS:PITCH"});
  expect_refused(live("-", {"--array", "6:6:1.9", "--poses", "-"}),
                 {"--poses -", "--sensor -", "x_mm"});
  expect_refused(live("-", {"--array", "6:6:1.9", "--pressure-unit", "psi"}),
                 {"--pressure-unit psi", "kPa"});
  expect_refused(live("simulate:A", {"--array", "6:6:1.9"}), {"--array", "--sensor -"});
  put_bytes(folder_ / "lines", "1,2,3\n");
  const Outcome outcome = palpate(live("-", {"--array", "6:6:1.9", "--json", "-"}),
                                  {.standard_input = folder_ / "lines"});
  EXPECT_EQ(outcome.status, 2);
  expect_named(outcome.err, {"standard input, line 1", "3 numbers", "36 elements"});
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
}

// A program that writes nothing any more keeps nobody from ending the session.
TEST_F(LiveLines, MayStayAwayForEver) {
  ASSERT_EQ(::mkfifo((folder_ / "silent").c_str(), 0600), 0);
  const int writer = ::open((folder_ / "silent").c_str(), O_RDWR);
  for (const char* sent : {"", "1,2,"}) {
    ASSERT_EQ(::write(writer, sent, std::strlen(sent)), static_cast<ssize_t>(std::strlen(sent)));
    const int before = ::dup(STDIN_FILENO);
    ::dup2(writer, STDIN_FILENO);
    const pid_t pid = start(live("-", {"--array", "6:6:1.9"}));
    ::dup2(before, STDIN_FILENO);
    ::close(before);
    ASSERT_GT(pid, 0);
    ::kill(pid, SIGINT);
    int status = 0;
    ::waitpid(pid, &status, 0);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << bytes_of(folder_ / "complained");
    std::filesystem::remove(folder_ / "said");
  }
  ::close(writer);
}

// The readings of a sensor that falls under load, and frames of which every two are swapped.
TEST_F(LiveLines, FallingReadingsAndSwappedFramesAreSaid) {
  done({"record", "--sensor", unknown_e, "-o", "frames.h5"});
  const Recording frames = read_recording(folder_ / "frames.h5");
  const auto line = [&](std::size_t i, double sign) {
    const Touch frame = frames.touch(i);
    const Pose& pose = frame.T_robot_sensor;
    std::string text = fmt::format("{:.17g},{},{},{}", frames.time_s[i], pose.translation_mm.x,
                                   pose.translation_mm.y, pose.theta_rad);
    for (const double p : frame.pressure) {
      text += fmt::format(",{}", sign * p);
    }
    return text + "\n";
  };
  std::string falling;
  std::string swapped;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    falling += line(i, -1.0);
    swapped += line(i + 1 < frames.size() + i % 2 ? i + 1 - 2 * (i % 2) : i, 1.0);
  }
  const auto live_of = [&](const std::string& lines, const Arguments& sign) {
    put_bytes(folder_ / "lines", lines);
    Arguments more{"--array", "6:6:1.9", "--json", "live.jsonl"};
    more.insert(more.end(), sign.begin(), sign.end());
    return palpate(live("-", more), {.standard_input = folder_ / "lines"});
  };
  expect_named(live_of(falling, {}).err, {"the readings fall below their rest", "--sign -1"});
  const Outcome outcome = live_of(falling, {"--sign", "-1"});
  EXPECT_EQ(outcome.err.find("fall"), std::string::npos) << outcome.err;
  EXPECT_FALSE(parsed(bytes_of(folder_ / "live.jsonl")).empty());
  const std::string said =
      fmt::format("time runs backwards at {} of {} frames", frames.size() / 2, frames.size());
  expect_named(live_of(swapped, {}).err, {said.c_str()});
}

}  // namespace palpate::live_lines_test
