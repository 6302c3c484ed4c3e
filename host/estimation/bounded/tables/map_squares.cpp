#include "estimation/bounded/tables/map_squares.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

namespace {

/// Places along one axis: from a node, -1 for the prior's before the first, towards the next.
struct Places {
  std::vector<int> node;
  std::vector<double> fraction;
  std::vector<int> first;  ///< [squares + 1] the place on a square's lower border

  void add(int at, double towards_next) {
    node.push_back(at);
    fraction.push_back(towards_next);
  }
  void begin_square() { first.push_back(static_cast<int>(node.size())); }
};

Places places_of_cells(int nodes, int parts) {
  Places places;
  for (int i = 0; i <= (nodes + 1) * parts; ++i) {
    places.begin_square();
    places.add(i / parts - 1, static_cast<double>(i % parts) / parts);
  }
  return places;
}

Places places_of_size(int nodes, double square_cells) {
  Places places;
  const double end = nodes + 1.0;
  const auto squares = static_cast<int>(std::ceil(end / square_cells));
  double next_node = 0.0;
  for (int i = 0; i <= squares; ++i) {
    // All beyond the map is the prior, as its end is.
    const double border = std::min(i * square_cells, end);
    for (; next_node < border; next_node += 1.0) {
      places.add(static_cast<int>(next_node) - 1, 0.0);
    }
    const double node = std::floor(border);
    places.begin_square();
    places.add(static_cast<int>(node) - 1, border - node);
    next_node = node + 1.0;
  }
  return places;
}

MapSquares at_places(const OccupancyGrid& map, double prior_log_odds, Places x, Places y) {
  const auto cell = [&](int i, int j) -> double {
    return i < 0 || j < 0 || i >= map.nx || j >= map.ny
               ? prior_log_odds
               : map.log_odds[static_cast<std::size_t>(j) * map.nx + i];
  };
  MapSquares squares{.first_x = std::move(x.first), .first_y = std::move(y.first), .log_odds = {}};
  squares.log_odds.reserve(x.node.size() * y.node.size());
  for (std::size_t j = 0; j < y.node.size(); ++j) {
    const int row = y.node[j];
    for (std::size_t i = 0; i < x.node.size(); ++i) {
      const int column = x.node[i];
      const auto along = [&](int of_row) {
        return std::lerp(cell(column, of_row), cell(column + 1, of_row), x.fraction[i]);
      };
      squares.log_odds.push_back(
          y.fraction[j] == 0.0 ? along(row) : std::lerp(along(row), along(row + 1), y.fraction[j]));
    }
  }
  return squares;
}

}  // namespace

MapSquares squares_of_cells(const OccupancyGrid& map, double prior_log_odds, int parts) {
  return at_places(map, prior_log_odds, places_of_cells(map.nx, parts),
                   places_of_cells(map.ny, parts));
}

MapSquares squares_of_size(const OccupancyGrid& map, double prior_log_odds,
                           const glm::dvec2& square_mm) {
  return at_places(map, prior_log_odds, places_of_size(map.nx, square_mm.x / map.cell_mm),
                   places_of_size(map.ny, square_mm.y / map.cell_mm));
}

}  // namespace palpate
