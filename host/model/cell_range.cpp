#include "model/cell_range.hpp"

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate {

void MapOptions::validate() const {
  if (!(cell_mm >= least_length_mm && cell_mm <= most_length_mm)) {
    throw Error(Fault::input, fmt::format("cell size = {} mm: give {:g} to {:g} mm", cell_mm,
                                          least_length_mm, most_length_mm));
  }
  sensor.validate();
  classifier.validate();
}

bool CellRange::contains(const CellRange& other) const {
  return other.x >= x && other.y >= y && other.x + other.nx <= x + nx &&
         other.y + other.ny <= y + ny;
}

CellRange united(const CellRange& a, const CellRange& b) {
  if (a.nx == 0) {
    return b;
  }
  const std::int64_t x = std::min(a.x, b.x);
  const std::int64_t y = std::min(a.y, b.y);
  return {x, y, std::max(a.x + a.nx, b.x + b.nx) - x, std::max(a.y + a.ny, b.y + b.ny) - y};
}

CellRange common(const CellRange& a, const CellRange& b) {
  const std::int64_t x = std::max(a.x, b.x);
  const std::int64_t y = std::max(a.y, b.y);
  return {x, y, std::min(a.x + a.nx, b.x + b.nx) - x, std::min(a.y + a.ny, b.y + b.ny) - y};
}

CellRange cover(const glm::dvec2& lowest_mm, const glm::dvec2& highest_mm, double margin_mm,
                double cell_mm) {
  const auto first = [&](double mm) { return std::ceil((mm - margin_mm) / cell_mm); };
  const auto last = [&](double mm) { return std::floor((mm + margin_mm) / cell_mm); };
  // At least one cell: a reading may lie in a cell whose centre is beyond its support.
  const double nx = std::max(1.0, last(highest_mm.x) - first(lowest_mm.x) + 1.0);
  const double ny = std::max(1.0, last(highest_mm.y) - first(lowest_mm.y) + 1.0);
  if (!(nx * ny <= static_cast<double>(most_cells))) {
    throw Error(Fault::input,
                fmt::format("the map would have {:.3g} x {:.3g} cells of {} mm; use larger cells, "
                            "or touches or a drawing of a smaller area",
                            nx, ny, cell_mm));
  }
  return {static_cast<std::int64_t>(first(lowest_mm.x)),
          static_cast<std::int64_t>(first(lowest_mm.y)), static_cast<std::int64_t>(nx),
          static_cast<std::int64_t>(ny)};
}

double support_radius_mm(const InverseSensorModel& sensor, std::size_t readings) {
  return sensor.support_radius_mm(16 * std::max<std::size_t>(readings, 8192), map_cut_tolerance);
}

OccupancyGrid map_frame(const MapOptions& options, const std::string& label,
                        const CellRange& range) {
  OccupancyGrid map;
  map.label = label;
  map.prior = options.sensor.prior;
  map.cell_mm = options.cell_mm;
  map.spread_mm = options.sensor.spread_mm;
  // Origins are whole multiples of the cell, so that maps can be compared cell by cell.
  map.origin_mm =
      options.cell_mm * glm::dvec2(static_cast<double>(range.x), static_cast<double>(range.y));
  map.nx = static_cast<int>(range.nx);
  map.ny = static_cast<int>(range.ny);
  return map;
}

}  // namespace palpate
