#include "figures/outlines.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "model/bounding_box.hpp"
#include "palpate/pose.hpp"

namespace palpate {

namespace {

double cross(glm::dvec2 a, glm::dvec2 b) { return a.x * b.y - a.y * b.x; }

/// Returns the convex hull, counter-clockwise, by Andrew's monotone chain.
std::vector<glm::dvec2> convex_hull(std::vector<glm::dvec2> points) {
  std::ranges::sort(
      points, [](glm::dvec2 a, glm::dvec2 b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
  std::vector<glm::dvec2> hull;
  const auto extend = [&](glm::dvec2 p, std::size_t start) {
    while (hull.size() >= start + 2 &&
           cross(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0.0) {
      hull.pop_back();
    }
    hull.push_back(p);
  };
  for (const glm::dvec2& p : points) {
    extend(p, 0);
  }
  const std::size_t upper_start = hull.size() - 1;
  for (auto p = points.rbegin() + 1; p < points.rend(); ++p) {
    extend(*p, upper_start);
  }
  if (hull.size() > 1) {
    hull.pop_back();  // the first point again
  }
  return hull;
}

/// Removes corners that only rounding makes, along straight rows of elements.
std::vector<glm::dvec2> without_straight_corners(std::span<const glm::dvec2> hull) {
  std::vector<glm::dvec2> corners;
  const std::size_t n = hull.size();
  for (std::size_t k = 0; k < n; ++k) {
    const glm::dvec2 in = hull[k] - hull[(k + n - 1) % n];
    const glm::dvec2 out = hull[(k + 1) % n] - hull[k];
    if (cross(in, out) > 1e-9 * glm::length(in) * glm::length(out)) {
      corners.push_back(hull[k]);
    }
  }
  return corners;
}

/// Returns the direction of the hull's edge along which the smallest enclosing rectangle lies.
double orientation_rad(std::span<const glm::dvec2> hull) {
  double best_area = std::numeric_limits<double>::infinity();
  double best_rad = 0.0;
  for (std::size_t k = 0; k < hull.size(); ++k) {
    const glm::dvec2 edge = hull[(k + 1) % hull.size()] - hull[k];
    const glm::dvec2 along = edge / glm::length(edge);
    BoundingBox box;
    for (const glm::dvec2& corner : hull) {
      box.take_in({glm::dot(along, corner - hull[k]), cross(along, corner - hull[k])});
    }
    const double area = box.extent().x * box.extent().y;
    if (area < best_area) {
      best_area = area;
      best_rad = std::atan2(edge.y, edge.x);
    }
  }
  return best_rad;
}

/// The centre of a cell, by its indices along x and y; those beside the grid count, too.
using Node = std::array<int, 2>;
/// A pair of neighbouring cells, an occupied one first.
using Crossing = std::array<Node, 2>;

double log_odds_at(const OccupancyGrid& map, const Node& node) {
  constexpr double beside_the_grid = -1.0;
  const bool inside = node[0] >= 0 && node[1] >= 0 && node[0] < map.nx && node[1] < map.ny;
  return inside ? static_cast<double>(map.at(node[0], node[1])) : beside_the_grid;
}

glm::dvec2 point_of(const OccupancyGrid& map, const Crossing& crossing) {
  const double in = log_odds_at(map, crossing[0]);
  const double out = log_odds_at(map, crossing[1]);
  return glm::mix(map.centre_mm(crossing[0][0], crossing[0][1]),
                  map.centre_mm(crossing[1][0], crossing[1][1]), in / (in - out));
}

/// The piece of an outline between four neighbouring cells leads from a crossing to the next, with
/// what is occupied on its left.
std::map<Crossing, Crossing> pieces_of(const OccupancyGrid& map) {
  std::map<Crossing, Crossing> next;
  for (int j = -1; j < map.ny; ++j) {
    for (int i = -1; i < map.nx; ++i) {
      const std::array<Node, 4> corners{Node{i, j}, {i + 1, j}, {i + 1, j + 1}, {i, j + 1}};
      std::array<bool, 4> occupied{};
      std::ranges::transform(corners, occupied.begin(),
                             [&](const Node& node) { return log_odds_at(map, node) > 0.0; });
      for (std::size_t k = 0; k < 4; ++k) {
        if (!occupied[k] || occupied[(k + 1) % 4]) {
          continue;
        }
        std::size_t back = (k + 1) % 4;  // the side on which the occupied part begins anew
        while (occupied[back] || !occupied[(back + 1) % 4]) {
          back = (back + 1) % 4;
        }
        next[{corners[k], corners[(k + 1) % 4]}] = {corners[(back + 1) % 4], corners[back]};
      }
    }
  }
  return next;
}

}  // namespace

Footprint footprint(std::span<const glm::dvec2> centres_mm, double element_mm) {
  Footprint result;
  if (centres_mm.empty()) {
    return result;
  }
  const double angle = orientation_rad(convex_hull({centres_mm.begin(), centres_mm.end()}));
  const glm::dvec2 along = rotate(angle, {element_mm / 2, 0.0});
  const glm::dvec2 across = rotate(angle, {0.0, element_mm / 2});
  std::vector<glm::dvec2> corners;
  for (const glm::dvec2& c : centres_mm) {
    const std::array square{c - along - across, c + along - across, c + along + across,
                            c - along + across};
    result.elements.push_back(square);
    corners.insert(corners.end(), square.begin(), square.end());
  }
  result.outline = without_straight_corners(convex_hull(std::move(corners)));
  return result;
}

std::vector<std::vector<glm::dvec2>> outlines_of(const OccupancyGrid& map) {
  std::map<Crossing, Crossing> next = pieces_of(map);
  std::vector<std::vector<glm::dvec2>> outlines;
  while (!next.empty()) {
    std::vector<glm::dvec2>& outline = outlines.emplace_back();
    for (auto piece = next.begin(); piece != next.end();) {
      outline.push_back(point_of(map, piece->first));
      const Crossing to = piece->second;
      next.erase(piece);
      piece = next.find(to);
    }
  }
  return outlines;
}

}  // namespace palpate
