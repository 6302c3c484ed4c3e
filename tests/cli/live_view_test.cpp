// What `palpate live` draws, as text.

#include "cli/live_screen.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "sample_files.hpp"

namespace palpate::cli::live_view_test {

LiveView sample_view(const OccupancyGrid& map) {
  LiveView view;
  view.object = "E (75.2 %)";
  view.pose = "x -9.87 +-0.25 mm, y 0.85 +-1.20 mm, theta -78.75 +-6.50 deg";
  view.sensor = "TakkTile 0012";
  view.state = "unknown 1, 3 touches";
  view.keys = "Ctrl-C: end";
  view.pressure_unit = "kPa";
  view.full_scale = 20.0;
  view.labels = {"A", "E", "a label that is far too long to be shown"};
  view.identity = {0.25, 0.75, 0.0};
  view.latency_ms = 3.0;
  view.worst_latency_ms = 7.0;
  view.map = &map;
  view.evidence_nats = 4.0;
  // Three elements in the corners of a square: pressed at the top left, dead at the bottom right.
  view.elements_mm = {{-4.0, 4.0}, {4.0, 4.0}, {4.0, -4.0}};
  view.pressure = {20.0, 0.0, 0.0};
  view.valid = {1, 1, 0};
  view.T_robot_sensor = Pose{};
  view.readings = {Reading::in_contact, Reading::no_contact, Reading::unknown};
  return view;
}

/// Columns of a line: characters that are no escape codes.
int columns_of(const std::string& line) {
  int columns = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '\033') {
      i = line.find('m', i);
    } else {
      columns += (line[i] & 0xC0) != 0x80 ? 1 : 0;
    }
  }
  return columns;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) {
    text += line + "\n";
  }
  return text;
}

TEST(LiveView, FitsWindowsOfAnySize) {
  const OccupancyGrid map = sample_map("E");
  LiveView view = sample_view(map);
  for (const bool touched : {true, false}) {
    if (!touched) {  // before the first frame
      view.map = nullptr;
      view.identity.clear();
      view.pressure.clear();
      view.T_robot_sensor.reset();
    }
    for (const auto colours :
         {TerminalColours::none, TerminalColours::palette, TerminalColours::direct}) {
      for (const int columns : {0, 1, 7, 43, 44, 80, 200}) {
        for (const int rows : {0, 1, 2, 3, 13, 14, 24, 50}) {
          const auto lines = draw(view, columns, rows, colours);
          ASSERT_EQ(lines.size(), static_cast<std::size_t>(rows));
          for (const std::string& line : lines) {
            ASSERT_LE(columns_of(line), columns) << columns << " x " << rows << ": " << line;
          }
        }
      }
    }
  }
}

TEST(LiveView, SaysThePoseFirstThenTheTruthAndWhatIsWrong) {
  const OccupancyGrid map = sample_map("E");
  LiveView view = sample_view(map);
  view.truth = "truth: E at x -9.94 mm, y 0.79 mm, theta -79.51 deg; error 0.15 mm";
  view.notes = {"unlike E: its 3 touches fit 11 standard deviations worse", "one", "two", "three"};
  for (const int rows : {8, 24}) {  // without and with pictures
    const auto lines = draw(view, 80, rows, TerminalColours::none);
    EXPECT_EQ(lines[0], "E (75.2 %): " + view.pose);
    EXPECT_EQ(lines[1], view.truth);
    EXPECT_EQ(lines[2], view.notes[0]);
    EXPECT_EQ(lines[4], "two") << "three notes leave room for the pictures";
    EXPECT_EQ(lines[5], view.state);
    EXPECT_TRUE(lines[6].starts_with("TakkTile 0012")) << joined(lines);
  }
  view.object = "a label that is far too long to be shown (75.2 %)";
  const std::string first = draw(view, 80, 24, TerminalColours::none)[0];
  EXPECT_EQ(first, "a label ...75.2 %): " + view.pose);
}

TEST(LiveView, DrawsTheArrayAsItLies) {
  const OccupancyGrid map = sample_map("E");
  const LiveView view = sample_view(map);
  const auto lines = draw(view, 80, 24, TerminalColours::none);
  // Below the heading: elements at the top left and right, at the bottom only the dead one.
  const std::string top = lines[5].substr(0, 32);
  EXPECT_EQ(top.find('@'), 0u) << joined(lines);
  EXPECT_EQ(top.find_first_not_of("@ "), std::string::npos) << joined(lines);
  // The last row of it: the first may share its cells with the element above.
  const auto dead = std::find_if(lines.rbegin(), lines.rend(), [](const std::string& line) {
    return line.substr(0, 32).find("xx") != std::string::npos;
  });
  ASSERT_NE(dead, lines.rend()) << joined(lines);
  EXPECT_GT(dead->find("xx"), 8u);
  EXPECT_EQ(dead->substr(0, 8), "        ");
  // On the map: in contact at the left of the other, which is at the same height.
  const auto touched = std::find_if(lines.begin(), lines.end(), [](const std::string& line) {
    return line.size() > 34 && line.find('@', 34) != line.npos;
  });
  ASSERT_NE(touched, lines.end()) << joined(lines);
  EXPECT_LT(touched->find('@', 34), touched->find('o', 34));
}

// An element may miss readings for a while, which are Unknown.
TEST(LiveView, AnUnknownReadingHasAMarkAndAColourOfItsOwn) {
  const OccupancyGrid map = sample_map("E");
  LiveView view = sample_view(map);
  const auto array_of = [&](TerminalColours colours) {
    std::string text;
    for (const std::string& line : draw(view, 80, 24, colours)) {
      text += line.substr(0, colours == TerminalColours::none ? 32 : line.size()) + "\n";
    }
    return text;
  };
  const auto colours = {TerminalColours::palette, TerminalColours::direct};
  std::vector<std::string> before;
  for (const TerminalColours c : colours) {
    before.push_back(array_of(c));
  }
  EXPECT_EQ(array_of(TerminalColours::none).find('?'), std::string::npos);
  view.pressure[1] = std::numeric_limits<double>::quiet_NaN();
  const std::string plain = array_of(TerminalColours::none);
  EXPECT_NE(plain.find("??"), std::string::npos) << plain;
  EXPECT_NE(plain.find("xx"), std::string::npos) << "dead is another thing:\n" << plain;
  std::size_t i = 0;
  for (const TerminalColours c : colours) {
    EXPECT_NE(array_of(c), before[i++]) << "0 is another thing";
  }
  view.valid[1] = 0;
  EXPECT_EQ(array_of(TerminalColours::none).find('?'), std::string::npos) << "dead, not Unknown";
}

// With every element against every other, and against every pixel, this would take minutes.
TEST(LiveView, DrawsALargeArrayAtOnce) {
  const OccupancyGrid map = sample_map("E");
  LiveView view = sample_view(map);
  view.elements_mm.clear();
  for (int i = 0; i < 40'000; ++i) {
    view.elements_mm.emplace_back(0.06 * (i % 200) - 6.0, 0.06 * (i / 200) - 6.0);
  }
  view.pressure.assign(view.elements_mm.size(), 20.0);
  view.valid.clear();
  view.readings.assign(view.elements_mm.size(), Reading::in_contact);
  const auto lines = draw(view, 80, 24, TerminalColours::none);
  EXPECT_NE(lines[5].substr(0, 32).find("@@@@"), std::string::npos) << joined(lines);
  EXPECT_NE(joined(lines).find("@@@@", 34), std::string::npos);
}

TEST(LiveView, DrawsAnUnseenMapWhite) {
  OccupancyGrid map = sample_map("E");
  map.prior = 0.1;
  map.log_odds.assign(map.log_odds.size(), static_cast<float>(map.prior_log_odds()));
  LiveView view = sample_view(map);
  view.T_robot_sensor.reset();
  const std::string text = joined(draw(view, 80, 24, TerminalColours::direct));
  EXPECT_NE(text.find("\033[38;2;255;255;255m\033[48;2;255;255;255m"), std::string::npos);
}

TEST(LiveView, BarsAreAsLongAsProbabilities) {
  const OccupancyGrid map = sample_map("E");
  const auto lines = draw(sample_view(map), 80, 24, TerminalColours::none);
  const auto bar = [&](const char* percent) {
    for (const std::string& line : lines) {
      if (line.find(percent) != line.npos) {
        return std::count(line.begin(), line.begin() + 32, '#');
      }
    }
    return std::ptrdiff_t{-1};
  };
  ASSERT_GT(bar("75.0 %"), 0) << joined(lines);
  EXPECT_NEAR(bar("75.0 %"), 3 * bar("25.0 %"), 2);
  EXPECT_EQ(bar(" 0.0 %"), 0);
}

TEST(LiveView, KeepsTheMostProbableLabels) {
  const OccupancyGrid map = sample_map("E");
  LiveView view = sample_view(map);
  view.labels.clear();
  view.identity.clear();
  for (int i = 0; i < 100; ++i) {
    view.labels.push_back("object " + std::to_string(i));
    view.identity.push_back(i == 77 ? 0.9 : 0.1 / 99);
  }
  const std::string text = joined(draw(view, 80, 24, TerminalColours::none));
  EXPECT_NE(text.find("object 77"), std::string::npos) << text;
  EXPECT_EQ(text.find("object 78"), std::string::npos) << text;
}

TEST(LiveView, ColoursAreTheTerminalsOwn) {
  const OccupancyGrid map = sample_map("E");
  LiveView view = sample_view(map);
  view.labels[0] = "\033[2J";  // a label is anybody's, and must not be obeyed
  const std::string plain = joined(draw(view, 80, 24, TerminalColours::none));
  EXPECT_TRUE(std::all_of(plain.begin(), plain.end(),
                          [](unsigned char c) { return c == '\n' || (c >= ' ' && c < 0x7F); }));
  const auto palette = draw(view, 80, 24, TerminalColours::palette);
  EXPECT_NE(joined(palette).find("\033[38;5;"), std::string::npos);
  EXPECT_EQ(joined(palette).find("\033[38;2;"), std::string::npos);
  EXPECT_EQ(joined(palette).find("\033[2J"), std::string::npos);
  const auto direct = draw(view, 80, 24, TerminalColours::direct);
  EXPECT_NE(joined(direct).find("\033[38;2;"), std::string::npos);
  for (const std::string& line : direct) {
    // No line leaves its colours to the next.
    EXPECT_TRUE(line.find('\033') == line.npos || line.ends_with("\033[0m")) << line;
  }
}

}  // namespace palpate::cli::live_view_test
