#include <algorithm>
#include <array>
#include <cmath>

#include <glm/common.hpp>

#include "figures/figures.hpp"
#include "figures/map_layer.hpp"
#include "model/bounding_box.hpp"
#include "palpate/error.hpp"
#include "palpate/pose.hpp"

namespace palpate {

namespace {

constexpr double margin_px = 40.0;
constexpr double gap_px = 12.0;
constexpr double title_px = 56.0;    ///< above each group
constexpr double caption_px = 26.0;  ///< below each tile
constexpr double legend_px = 120.0;  ///< below all groups
constexpr double bar_px = 440.0;
constexpr double bar_inset_px = 30.0;
constexpr double largest_tile_px = 240.0;
constexpr double smallest_tile_px = 40.0;
constexpr double highest_px = 30000.0;  ///< Cairo's limit is 32,767
constexpr std::size_t columns = 8;
constexpr Colour contact{0.05, 0.05, 0.05, 0.5};

/// The part of the object frame that a group's tiles show: the object and all contact, square.
BoundingBox shown(const DrawnPresses& group) {
  BoundingBox box;
  if (group.map) {
    box = occupied_box(*group.map);
  }
  double element_mm = 0.0;
  for (const DrawnPress& press : group.presses) {
    for (const glm::dvec2& p : press.contacts_mm) {
      box.take_in(p);
    }
    element_mm = std::max(element_mm, press.element_mm);
  }
  if (box.empty()) {
    box.take_in({0.0, 0.0});
  }
  const glm::dvec2 extent = box.extent();
  const double half_mm = 0.5 * std::max(extent.x, extent.y) + 2.0 * element_mm + 1e-3;
  const glm::dvec2 middle = box.middle();
  return {middle - half_mm, middle + half_mm};
}

std::size_t tiles_of(const DrawnPresses& group) {
  return group.presses.size() + (group.map ? 1 : 0);
}

std::size_t rows_of(const DrawnPresses& group) { return (tiles_of(group) + columns - 1) / columns; }

/// The edge of a tile, in pixels.
double tile_for(std::span<const DrawnPresses> groups) {
  std::size_t rows = 0;
  for (const DrawnPresses& group : groups) {
    rows += rows_of(group);
  }
  const double left = highest_px - legend_px - 2 * margin_px -
                      static_cast<double>(groups.size()) * title_px -
                      static_cast<double>(rows) * (caption_px + gap_px);
  return std::clamp(std::floor(left / static_cast<double>(std::max<std::size_t>(rows, 1))),
                    smallest_tile_px, largest_tile_px);
}

void draw_tile(Canvas& canvas, const Box& box, const BoundingBox& part, const DrawnPresses& group,
               const DrawnPress* press, const EvidenceScale& scale) {
  const View view{.box = box, .lower = part.lower, .upper = part.upper};
  {
    const Canvas::Clip clip(canvas, box);
    if (group.map) {
      draw_cells(canvas, view, *group.map, scale);
    }
    if (press != nullptr) {
      const glm::dvec2 along = rotate(press->theta_rad, {press->element_mm / 2, 0.0});
      const glm::dvec2 across(-along.y, along.x);
      for (const glm::dvec2& c : press->contacts_mm) {
        const std::array corners{view.pixel(c - along - across), view.pixel(c + along - across),
                                 view.pixel(c + along + across), view.pixel(c - along + across)};
        canvas.fill(corners, contact);
      }
    }
  }
  canvas.frame(box, {.colour = grey, .width_px = 1.0});
  const std::string caption = press != nullptr ? press->caption : "the map";
  canvas.text(canvas.fit(caption, box.width, small), {box.left, box.bottom() + caption_px - 7.0},
              small);
}

}  // namespace

std::string draw_presses(std::span<const DrawnPresses> groups) {
  if (groups.empty()) {
    throw Error(Fault::input, "no press to draw: give at least one group");
  }
  std::vector<OccupancyGrid> maps;
  double height = 2 * margin_px + legend_px;
  const double tile_px = tile_for(groups);
  std::size_t widest = 4;  // as wide as the colour bar
  for (const DrawnPresses& group : groups) {
    if (group.map) {
      require_cells(*group.map);
      maps.push_back(*group.map);
    }
    widest = std::max(widest, std::min(columns, tiles_of(group)));
    height += title_px + static_cast<double>(rows_of(group)) * (tile_px + caption_px + gap_px);
  }
  const EvidenceScale scale = evidence_scale(maps);
  const double content = std::max(static_cast<double>(widest) * (tile_px + gap_px) - gap_px,
                                  bar_px + 2 * bar_inset_px);
  Canvas canvas(static_cast<int>(content + 2 * margin_px), static_cast<int>(height));
  double top = margin_px;
  for (const DrawnPresses& group : groups) {
    canvas.text(canvas.fit(group.title, content, heading), {margin_px, top + title_px - 18.0},
                heading);
    top += title_px;
    const BoundingBox part = shown(group);
    for (std::size_t tile = 0; tile < tiles_of(group); ++tile) {
      const std::size_t row = tile / columns;
      const Box box{margin_px + static_cast<double>(tile % columns) * (tile_px + gap_px),
                    top + static_cast<double>(row) * (tile_px + caption_px + gap_px), tile_px,
                    tile_px};
      const std::size_t first = group.map ? 1 : 0;
      draw_tile(canvas, box, part, group, tile < first ? nullptr : &group.presses[tile - first],
                scale);
    }
    top += static_cast<double>(rows_of(group)) * (tile_px + caption_px + gap_px);
  }
  draw_evidence_bar(canvas, {margin_px + bar_inset_px, top + 44.0, bar_px, 20.0}, scale);
  return canvas.encode();
}

}  // namespace palpate
