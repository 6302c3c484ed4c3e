#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

#include <glm/vec2.hpp>

#include "palpate/map_builder.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// Cells [x, x + nx) x [y, y + ny), where cell (i, j) is centred at cell_mm * (i, j).
struct CellRange {
  std::int64_t x = 0;
  std::int64_t y = 0;
  std::int64_t nx = 0;
  std::int64_t ny = 0;

  bool contains(const CellRange& other) const;
  /// Index of cell (i, j) in row-major order.
  std::size_t index(std::int64_t i, std::int64_t j) const {
    return static_cast<std::size_t>((j - y) * nx + i - x);
  }
};

/// Returns the smallest range that holds both; an empty range adds nothing.
CellRange united(const CellRange& a, const CellRange& b);
/// Returns the cells that both hold; nx or ny is at most 0 where there are none.
CellRange common(const CellRange& a, const CellRange& b);

/// Returns the cells whose centres lie within `margin_mm` of the rectangle, whose corners must lie
/// within `farthest_mm`.
/// @throws Error where these are more than most_cells
CellRange cover(const glm::dvec2& lowest_mm, const glm::dvec2& highest_mm, double margin_mm,
                double cell_mm);

/// Calls visit(index in the range, squared distance in mm^2) for every cell of a range whose centre
/// lies within `radius_mm` of a place.
template <typename Visit>
void visit_near(const CellRange& cells, double cell_mm, const glm::dvec2& place_mm,
                double radius_mm, const Visit& visit) {
  const auto from = [&](double mm, std::int64_t first) {
    return std::max(first, static_cast<std::int64_t>(std::ceil((mm - radius_mm) / cell_mm)));
  };
  const auto to = [&](double mm, std::int64_t end) {
    return std::min(end - 1, static_cast<std::int64_t>(std::floor((mm + radius_mm) / cell_mm)));
  };
  for (std::int64_t j = from(place_mm.y, cells.y); j <= to(place_mm.y, cells.y + cells.ny); ++j) {
    const double dy = cell_mm * static_cast<double>(j) - place_mm.y;
    for (std::int64_t i = from(place_mm.x, cells.x); i <= to(place_mm.x, cells.x + cells.nx); ++i) {
      const double dx = cell_mm * static_cast<double>(i) - place_mm.x;
      if (const double squared = dx * dx + dy * dy; squared <= radius_mm * radius_mm) {
        visit(cells.index(i, j), squared);
      }
    }
  }
}

/// Radius in mm at which the Gaussian of readings is cut off. Reading i may lose
/// map_cut_tolerance / (16 max(i, 8192)) nats: together below the tolerance for up to 10^10
/// readings.
/// @param readings so far
double support_radius_mm(const InverseSensorModel& sensor, std::size_t readings);
/// Nats that a map's cell may lose where Gaussians are cut off: half of the documented tolerance,
/// the other half is for float32 rounding.
inline constexpr double map_cut_tolerance = 5e-4;

/// A map of these cells, still without their log odds.
OccupancyGrid map_frame(const MapOptions& options, const std::string& label,
                        const CellRange& range);

}  // namespace palpate
