#include "cli/terminal_canvas.hpp"
#include "limits.hpp"

#include <gtest/gtest.h>

namespace palpate::cli::terminal_canvas_test {

/// The line of a canvas of one row.
std::string line_of(const TerminalCanvas& canvas, TerminalColours colours) {
  const auto lines = canvas.lines(colours);
  EXPECT_EQ(lines.size(), 1u);
  return lines.front();
}

TEST(TerminalCanvas, BarIsAsLongAsItsFractionToAnEighthOfAColumn) {
  const std::string glyphs[] = {"", "▏", "▎", "▍", "▌", "▋", "▊", "▉", "█"};
  for (int eighths = 1; eighths <= 32; ++eighths) {
    TerminalCanvas canvas(6, 1);
    canvas.bar(0, 0, 4, eighths / 32.0, ink);
    std::string expected;
    for (int left = eighths; left > 0; left -= 8) {
      expected += glyphs[std::min(left, 8)];
    }
    const std::string line = line_of(canvas, TerminalColours::direct);
    EXPECT_NE(line.find("m" + expected + "\033[0m"), std::string::npos) << eighths << ": " << line;
    EXPECT_EQ(line_of(canvas, TerminalColours::none), std::string((eighths + 4) / 8, '#'));
  }
}

TEST(TerminalCanvas, TakesTheNearestOfAPaletteOf256Colours) {
  const auto code_of = [](const Colour& colour) {
    TerminalCanvas canvas(1, 1);
    canvas.pixel(0, 0, {.colour = colour});
    canvas.pixel(0, 1, {.colour = {1.0, 1.0, 1.0}});
    const std::string line = line_of(canvas, TerminalColours::palette);
    const std::size_t begin = line.find("38;5;") + 5;
    return line.substr(begin, line.find('m', begin) - begin);
  };
  // xterm's: a cube of 6 levels a colour from 16 on, 24 greys from 232 on.
  EXPECT_EQ(code_of({1.0, 0.0, 0.0}), "196");
  EXPECT_EQ(code_of({0.0, 1.0, 0.0}), "46");
  EXPECT_EQ(code_of({0.0, 0.0, 1.0}), "21");
  EXPECT_EQ(code_of({1.0, 0.5, 0.0}), "208");
  EXPECT_EQ(code_of({0.5, 0.5, 0.5}), "244");
}

TEST(TerminalCanvas, NotANumberIsBlankAndBlack) {
  TerminalCanvas canvas(3, 1);
  canvas.pixel(0, 0, {.colour = {nan, nan, nan}, .shade = nan});
  canvas.pixel(1, 0, {.shade = 1.0});
  canvas.pixel(1, 1, {.shade = 1.0});
  EXPECT_EQ(line_of(canvas, TerminalColours::none), " @");
  EXPECT_TRUE(line_of(canvas, TerminalColours::direct).starts_with("\033[38;2;0;0;0m"));
  EXPECT_TRUE(line_of(canvas, TerminalColours::palette).starts_with("\033[38;5;16m"));
  TerminalCanvas bar(3, 1);
  bar.bar(0, 0, 3, nan, ink);
  EXPECT_EQ(line_of(bar, TerminalColours::none), "");
}

}  // namespace palpate::cli::terminal_canvas_test
