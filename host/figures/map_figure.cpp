#include <algorithm>
#include <cmath>
#include <string>

#include <glm/common.hpp>

#include "figures/figures.hpp"
#include "figures/view.hpp"

namespace palpate {

namespace {

constexpr double maps_apart_px = 24.0;
constexpr double below_px = 60.0;    ///< below each map, for its axis
constexpr double title_px = 60.0;    ///< above the maps
constexpr double label_px = 34.0;    ///< above each map
constexpr double legend_px = 150.0;  ///< below the maps
constexpr double tiles_px = 1800.0;  ///< width to share among the columns
constexpr double largest_tile_px = 600.0;
constexpr double smallest_tile_px = 60.0;
constexpr double bar_px = 440.0;
constexpr double bar_inset_px = 30.0;  ///< room for the last tick's label

/// Layout of the maps: rows of tiles as large as the largest map, at one scale.
struct Grid {
  int columns = 1;
  int rows = 1;
  double px_per_mm = 1.0;
  glm::dvec2 tile_px{0.0, 0.0};
};

Grid arrange(std::span<const OccupancyGrid> maps) {
  const int n = static_cast<int>(maps.size());
  const int at_most = std::max(6, static_cast<int>(std::ceil(std::sqrt(n))));
  Grid grid;
  grid.rows = (n + at_most - 1) / at_most;
  grid.columns = (n + grid.rows - 1) / grid.rows;

  glm::dvec2 extent_mm(0.0);
  for (const OccupancyGrid& map : maps) {
    extent_mm = glm::max(extent_mm, map.cell_mm * glm::dvec2(map.nx, map.ny));
  }
  const double side_px = std::clamp(tiles_px / grid.columns - axis_px - maps_apart_px,
                                    smallest_tile_px, largest_tile_px);
  grid.px_per_mm = side_px / std::max(extent_mm.x, extent_mm.y);
  // A narrow map still needs width for its label.
  grid.tile_px = glm::max(glm::ceil(grid.px_per_mm * extent_mm), glm::dvec2(smallest_tile_px, 1.0));
  return grid;
}

/// Draws the x and y axis of the object frame, where its origin lies on the map.
void draw_frame(Canvas& canvas, const View& view) {
  constexpr double arm_px = 36.0;
  const Canvas::Clip clip(canvas, view.box);
  const glm::dvec2 origin = view.pixel({0.0, 0.0});
  const Pen pen{.width_px = 3.0, .halo_px = 2.0};
  canvas.segment(origin, origin + glm::dvec2(arm_px, 0.0), pen);
  canvas.segment(origin, origin - glm::dvec2(0.0, arm_px), pen);
  for (const auto& [letter, place] : {std::pair("x", glm::dvec2(arm_px + 13.0, 0.0)),
                                      std::pair("y", glm::dvec2(0.0, -arm_px - 13.0))}) {
    canvas.disc(origin + place, 11.0, {1.0, 1.0, 1.0});
    canvas.text(letter, origin + place + glm::dvec2(0.0, 5.0), body, Align::centre);
  }
}

void draw_tile(Canvas& canvas, const Box& tile, double px_per_mm, const OccupancyGrid& map,
               const EvidenceScale& scale) {
  const glm::dvec2 size = glm::round(px_per_mm * map.cell_mm * glm::dvec2(map.nx, map.ny));
  const View view{.box = {tile.left + std::floor((tile.width - size.x) / 2), tile.top,
                          std::max(size.x, 1.0), std::max(size.y, 1.0)},
                  .lower = lower_edge_mm(map),
                  .upper = upper_edge_mm(map)};
  draw_cells(canvas, view, map, scale);
  draw_frame(canvas, view);
  // A label of a tick takes some 80 pixels along x and 40 along y.
  const auto ticks = [](double lower, double upper, double room) {
    return even_ticks(lower, upper, std::clamp(static_cast<int>(room), 1, 6));
  };
  draw_axes(canvas, view, ticks(view.lower.x, view.upper.x, view.box.width / 80.0),
            ticks(view.lower.y, view.upper.y, view.box.height / 40.0), "x, mm", "y, mm");
  canvas.text(canvas.fit(map.label, tile.width, heading),
              {tile.left + tile.width / 2, tile.top - 10.0}, heading, Align::centre);
}

}  // namespace

std::string draw_maps(std::span<const OccupancyGrid> maps) {
  const EvidenceScale scale = evidence_scale(maps);
  const Grid grid = arrange(maps);

  const double column_px = axis_px + grid.tile_px.x + maps_apart_px;
  const double tiles_width = grid.columns * column_px - maps_apart_px;
  const double content = std::max(tiles_width, bar_px + 2 * bar_inset_px);
  const double row_px = label_px + grid.tile_px.y + below_px + maps_apart_px;
  const double legend_top = title_px + margin_px + grid.rows * row_px;
  Canvas canvas(static_cast<int>(content + 2 * margin_px),
                static_cast<int>(legend_top + legend_px));

  const bool drawn = std::ranges::all_of(maps, &OccupancyGrid::drawn);
  canvas.text(drawn ? "Maps from drawings" : "Maps built from touch", {margin_px, margin_px + 20.0},
              {.size_px = 28.0, .bold = true});
  const double left = margin_px + std::floor((content - tiles_width) / 2);
  for (std::size_t k = 0; k < maps.size(); ++k) {
    const double column = static_cast<double>(k % grid.columns);
    const std::size_t row_index = k / grid.columns;
    const auto row = static_cast<double>(row_index);
    const Box tile{left + column * column_px + axis_px,
                   title_px + margin_px + row * row_px + label_px, grid.tile_px.x, grid.tile_px.y};
    draw_tile(canvas, tile, grid.px_per_mm, maps[k], scale);
  }
  draw_evidence_bar(canvas,
                    {margin_px + content - bar_px - bar_inset_px, legend_top + 36.0, bar_px, 20.0},
                    scale);
  return canvas.encode();
}

}  // namespace palpate
