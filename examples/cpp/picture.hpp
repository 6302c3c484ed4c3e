// Pictures as SVG, which every browser shows.
#pragma once

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

/// A picture of a grid of cells, with marks on it. Coordinates are in cells, from the middle of the
/// lower left cell; y points up.
class Picture {
 public:
  Picture(int columns, int rows) : columns_(columns), rows_(rows) {}

  /// Colours a cell: from white at 0 to red at 1, and to blue at -1, in 16 steps each.
  void cell(int x, int y, double value) {
    const int step = static_cast<int>(std::lround(16.0 * std::clamp(value, -1.0, 1.0)));
    if (step != 0) {
      cells_[step] += "M" + std::to_string(x) + " " + std::to_string(rows_ - 1 - y) + "h1v1h-1z";
    }
  }

  void circle(double x, double y, double radius, const std::string& style) {
    marks_ << R"(<circle cx=")" << x + 0.5 << R"(" cy=")" << rows_ - 0.5 - y << R"(" r=")" << radius
           << R"(" )" << style << "/>\n";
  }

  void save(const std::string& path) const {
    constexpr int pixels = 6;  // of a cell
    std::ofstream file(path);
    file << R"(<svg xmlns="http://www.w3.org/2000/svg" width=")" << pixels * columns_
         << R"(" height=")" << pixels * rows_ << R"(" viewBox="0 0 )" << columns_ << " " << rows_
         << "\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
         << "<g shape-rendering=\"crispEdges\">\n";
    for (const auto& [step, path_of_cells] : cells_) {
      const int full = 255 - 2 * std::abs(step);
      const int faded = 255 - 14 * std::abs(step);
      file << "<path fill=\"rgb(" << (step > 0 ? full : faded) << "," << faded << ","
           << (step < 0 ? full : faded) << ")\" d=\"" << path_of_cells << "\"/>\n";
    }
    file << "</g>\n" << marks_.str() << "</svg>\n";
  }

 private:
  int columns_;
  int rows_;
  std::map<int, std::string> cells_;
  std::ostringstream marks_;
};
