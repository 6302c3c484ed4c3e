#include "figures/map_outline.hpp"

#include <algorithm>
#include <array>
#include <map>

#include <glm/common.hpp>

namespace palpate {

namespace {

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
