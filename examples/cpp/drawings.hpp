// Draws the pictures of the examples as SVG, which every browser shows.
#pragma once

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <palpate/palpate.hpp>

/// A picture of a grid of cells, with marks on it. Coordinates are in cells, from the middle of the
/// lower left cell; y points up.
class Picture {
 public:
  Picture(int columns, int rows) : columns_(columns), rows_(rows) {}

  /// Colours a cell: from white at 0 to red at 1, and to blue at -1, in 16 steps each.
  void cell(int x, int y, double value) {
    const int step = static_cast<int>(std::lround(16.0 * std::clamp(value, -1.0, 1.0)));
    if (step != 0) cells_[step] << "M" << x << " " << rows_ - 1 - y << "h1v1h-1z";
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
           << (step < 0 ? full : faded) << ")\" d=\"" << path_of_cells.str() << "\"/>\n";
    }
    file << "</g>\n" << marks_.str() << "</svg>\n";
  }

 private:
  int columns_;
  int rows_;
  std::map<int, std::ostringstream> cells_;
  std::ostringstream marks_;
};

/// What the touches say about each cell beyond the prior: red is occupied, blue is empty.
inline Picture picture_of(const palpate::OccupancyGrid& map) {
  Picture picture(map.nx, map.ny);
  for (int y = 0; y < map.ny; ++y) {
    for (int x = 0; x < map.nx; ++x) {
      const double log_odds = map.log_odds[y * map.nx + x];
      picture.cell(x, y, (log_odds - palpate::log_odds_from_probability(map.prior)) / 8.0);
    }
  }
  return picture;
}

/// The elements in contact, on the map that they were recognised by.
inline void draw_touches(const std::vector<palpate::Touch>& touches,
                         const palpate::OccupancyGrid& map, const palpate::Pose& T_object_robot,
                         const std::string& path) {
  Picture picture = picture_of(map);
  for (const palpate::Touch& touch : touches) {
    const palpate::Pose T_object_sensor = T_object_robot * touch.T_robot_sensor;
    const std::vector<palpate::Reading> readings = palpate::ContactClassifier{}.classify(touch);
    for (std::size_t i = 0; i < readings.size(); ++i) {
      if (readings[i] == palpate::Reading::in_contact) {
        const glm::dvec2 p_object_mm = T_object_sensor * touch.elements_mm[i];
        const glm::dvec2 at = (p_object_mm - map.origin_mm) / map.cell_mm;
        picture.circle(at.x, at.y, 0.5, "");
      }
    }
  }
  picture.save(path);
}

/// The probability of each x and y, by its logarithm: white is a thousandth of the largest, or
/// less.
inline Picture picture_of(const palpate::Marginals& marginals) {
  const int nx = marginals.grid.x_mm.count;
  const int ny = marginals.grid.y_mm.count;
  const double most = *std::max_element(marginals.xy.begin(), marginals.xy.end());
  Picture picture(nx, ny);
  for (int y = 0; y < ny; ++y) {
    for (int x = 0; x < nx; ++x) {
      const double share = marginals.xy[y * nx + x] / most;
      picture.cell(x, y, share > 1e-3 ? -1.0 - std::log10(share) / 3.0 : 0.0);
    }
  }
  return picture;
}

/// Circles a pose on the picture of its marginals.
inline void circle_pose(Picture& picture, const palpate::PoseLattice& bins,
                        const palpate::Pose& T_object_robot) {
  const glm::dvec2 at_mm = T_object_robot.translation_mm;
  picture.circle((at_mm.x - bins.x_mm.centre(0)) / bins.x_mm.step(),
                 (at_mm.y - bins.y_mm.centre(0)) / bins.y_mm.step(), 3.0,
                 R"(fill="none" stroke="#000" stroke-width=".5")");
}
