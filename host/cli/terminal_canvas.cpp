#include "cli/terminal_canvas.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "model/printable.hpp"

namespace palpate::cli {

namespace {

constexpr std::string_view reset = "\033[0m";

/// The value clamped to [0, 1]; 0 for NaN, which must not be converted to an integer.
double in_unit(double v) { return std::isnan(v) ? 0.0 : std::clamp(v, 0.0, 1.0); }

struct Bytes {
  int red;
  int green;
  int blue;
};

Bytes bytes_of(const Colour& colour) {
  const auto byte = [](double c) { return static_cast<int>(std::lround(255.0 * in_unit(c))); };
  return {byte(colour.red), byte(colour.green), byte(colour.blue)};
}

/// Index of the nearest colour among the 216 of xterm's cube and its 24 greys.
int palette_index(const Bytes& c) {
  constexpr std::array<int, 6> steps{0, 95, 135, 175, 215, 255};
  const auto nearest_step = [&](int value) {
    return static_cast<int>(
        std::min_element(steps.begin(), steps.end(),
                         [&](int a, int b) { return std::abs(a - value) < std::abs(b - value); }) -
        steps.begin());
  };
  const auto distance = [&](int red, int green, int blue) {
    return (c.red - red) * (c.red - red) + (c.green - green) * (c.green - green) +
           (c.blue - blue) * (c.blue - blue);
  };
  const int r = nearest_step(c.red);
  const int g = nearest_step(c.green);
  const int b = nearest_step(c.blue);
  const int grey = std::clamp(((c.red + c.green + c.blue) / 3 - 3) / 10, 0, 23);
  const int value = 8 + 10 * grey;
  return distance(value, value, value) < distance(steps[r], steps[g], steps[b])
             ? 232 + grey
             : 16 + 36 * r + 6 * g + b;
}

/// The escape code of a colour. @param ground 38 for the foreground, 48 for the background
std::string colour_code(int ground, const Colour& colour, TerminalColours colours) {
  const Bytes c = bytes_of(colour);
  return colours == TerminalColours::direct
             ? fmt::format("\033[{};2;{};{};{}m", ground, c.red, c.green, c.blue)
             : fmt::format("\033[{};5;{}m", ground, palette_index(c));
}

char ascii_of(const Pixel& upper, const Pixel& lower) {
  if (upper.mark != 0 || lower.mark != 0) {
    return upper.mark != 0 ? upper.mark : lower.mark;
  }
  constexpr std::string_view ramp = " .:-=+*#%@";
  const double shade = in_unit(0.5 * (upper.shade + lower.shade));
  return ramp[static_cast<std::size_t>(std::lround(shade * static_cast<double>(ramp.size() - 1)))];
}

}  // namespace

TerminalCanvas::TerminalCanvas(int columns, int rows)
    : columns_(std::max(columns, 0)),
      rows_(std::max(rows, 0)),
      cells_(static_cast<std::size_t>(columns_) * rows_) {}

TerminalCanvas::Cell* TerminalCanvas::at(int column, int row) {
  const bool inside = column >= 0 && column < columns_ && row >= 0 && row < rows_;
  return inside ? &cells_[static_cast<std::size_t>(row) * columns_ + column] : nullptr;
}

void TerminalCanvas::text(int column, int row, std::string_view text, bool strong) {
  const std::string characters = printable(text);
  for (std::size_t begin = 0; begin < characters.size(); ++column) {
    std::size_t end = begin + 1;
    while (end < characters.size() && (characters[end] & 0xC0) == 0x80) {
      ++end;
    }
    if (Cell* cell = at(column, row)) {
      cell->glyph = characters.substr(begin, end - begin);
      cell->ascii = end - begin == 1 ? characters[begin] : '?';
      cell->strong = strong;
    }
    begin = end;
  }
}

void TerminalCanvas::bar(int column, int row, int columns, double fraction, const Colour& colour) {
  constexpr std::array<const char*, 9> eighths{" ", "▏", "▎", "▍", "▌", "▋", "▊", "▉", "█"};
  const auto filled = static_cast<int>(std::lround(8.0 * columns * in_unit(fraction)));
  for (int i = 0; i < columns; ++i) {
    if (Cell* cell = at(column + i, row)) {
      const int part = std::clamp(filled - 8 * i, 0, 8);
      cell->glyph = eighths[static_cast<std::size_t>(part)];
      cell->ascii = part >= 4 ? '#' : ' ';
      cell->coloured = true;
      cell->upper.colour = colour;
    }
  }
}

void TerminalCanvas::pixel(int column, int pixel_row, const Pixel& pixel) {
  if (Cell* cell = pixel_row < 0 ? nullptr : at(column, pixel_row / 2)) {
    cell->pixels = true;
    (pixel_row % 2 == 0 ? cell->upper : cell->lower) = pixel;
  }
}

std::vector<std::string> TerminalCanvas::lines(TerminalColours colours) const {
  const bool plain = colours == TerminalColours::none;
  std::vector<std::string> lines;
  for (int row = 0; row < rows_; ++row) {
    std::string line;
    std::string style;  // the escape codes in effect
    std::size_t inked = 0;
    for (int column = 0; column < columns_; ++column) {
      const Cell& cell = cells_[static_cast<std::size_t>(row) * columns_ + column];
      std::string wanted;
      std::string glyph = cell.glyph;
      if (plain) {
        glyph = cell.pixels ? ascii_of(cell.upper, cell.lower) : cell.ascii;
      } else if (cell.pixels) {
        wanted = colour_code(38, cell.upper.colour, colours) +
                 colour_code(48, cell.lower.colour, colours);
        glyph = "▀";
      } else if (cell.coloured) {
        wanted = colour_code(38, cell.upper.colour, colours);
      } else if (cell.strong) {
        wanted = "\033[1m";
      }
      if (glyph == " " && !cell.strong) {
        wanted.clear();  // the background is the terminal's own
      }
      if (wanted != style) {
        line += (style.empty() ? "" : std::string(reset)) + wanted;
        style = wanted;
      }
      line += glyph;
      inked = glyph == " " ? inked : line.size();
    }
    line.resize(inked);
    // The code that resets the style may have been cut off with the blanks.
    lines.push_back(line.find('\033') == line.npos ? line : line + std::string(reset));
  }
  return lines;
}

}  // namespace palpate::cli
