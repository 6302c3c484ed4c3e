#include "refined_blocks_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>

#include <fmt/format.h>

#include "figures/axes.hpp"
#include "figures/map_layer.hpp"
#include "letters.hpp"
#include "table.hpp"

namespace palpate::bench {

namespace {

constexpr double margin_px = 36.0;
constexpr double side_px = 500.0;
constexpr double axis_px = 84.0;
constexpr double top_px = 104.0;
constexpr double gap_px = 68.0;  ///< between panels
constexpr double legend_px = top_px + side_px + 108.0;
constexpr double height_px = legend_px + 40.0;

constexpr Colour occupied{0.72, 0.72, 0.72};
// Opacity of blocks that the search went into at every theta.
constexpr double divided_alpha = 0.26;
constexpr double evaluated_alpha = 0.95;
constexpr Pen truth_pen{.colour = {0.0, 0.0, 0.0}, .width_px = 3.5, .halo_px = 2.5};

/// Blocks of one place and size, over all thetas.
struct Tile {
  int level = 0;
  glm::dvec2 lower_mm{0.0};
  glm::dvec2 upper_mm{0.0};
  double share = 0.0;  ///< of the thetas
};

/// By rising level: smaller ones are drawn over larger ones.
std::vector<Tile> tiles_of(std::span<const PoseBlock> blocks, int object,
                           const PoseLattice& lattice) {
  std::map<std::tuple<int, int, int, int, int>, int> thetas;
  for (const PoseBlock& b : blocks) {
    if (b.object == object) {
      ++thetas[{b.level, b.x_first, b.x_count, b.y_first, b.y_count}];
    }
  }
  const auto edge_mm = [](const Axis& axis, int bin) { return axis.lower + axis.step() * bin; };
  std::vector<Tile> tiles;
  for (const auto& [at, count] : thetas) {
    const auto& [level, x, nx, y, ny] = at;
    tiles.push_back({.level = level,
                     .lower_mm = {edge_mm(lattice.x_mm, x), edge_mm(lattice.y_mm, y)},
                     .upper_mm = {edge_mm(lattice.x_mm, x + nx), edge_mm(lattice.y_mm, y + ny)},
                     .share = static_cast<double>(count) / lattice.theta_rad.count});
  }
  return tiles;
}

Colour level_colour(int level, int levels) {
  // From pale to full, and from blue to orange on the last level, where bins are evaluated.
  constexpr Colour first{0.66, 0.80, 0.94};
  constexpr Colour last{0.10, 0.40, 0.72};
  if (level + 1 >= levels) {
    return {0.90, 0.36, 0.05};
  }
  const double t = levels > 2 ? static_cast<double>(level) / (levels - 2) : 0.0;
  return {std::lerp(first.red, last.red, t), std::lerp(first.green, last.green, t),
          std::lerp(first.blue, last.blue, t)};
}

Colour with_alpha(Colour colour, double alpha) {
  colour.alpha = alpha;
  return colour;
}

std::array<glm::dvec2, 4> corners_of(const Box& box) {
  return {glm::dvec2(box.left, box.top), glm::dvec2(box.right(), box.top),
          glm::dvec2(box.right(), box.bottom()), glm::dvec2(box.left, box.bottom())};
}

void draw_cross(Canvas& canvas, const glm::dvec2& at) {
  for (const glm::dvec2& arm : {glm::dvec2(10.0, 0.0), glm::dvec2(0.0, 10.0)}) {
    const std::array near{at - arm, at - 0.45 * arm};
    const std::array far{at + 0.45 * arm, at + arm};
    canvas.line(near, truth_pen);
    canvas.line(far, truth_pen);
  }
}

/// The map's occupancy in greys.
void draw_occupancy(Canvas& canvas, const View& view, const OccupancyGrid& map) {
  canvas.cells(view.pixels(lower_edge_mm(map), upper_edge_mm(map)), map.nx, map.ny,
               [&](int i, int j) {
                 const double p = 1.0 / (1.0 + std::exp(-map.at(i, j)));
                 return Colour{std::lerp(1.0, occupied.red, p), std::lerp(1.0, occupied.green, p),
                               std::lerp(1.0, occupied.blue, p)};
               });
}

void draw_tiles(Canvas& canvas, const View& view, const std::vector<Tile>& tiles, int levels) {
  for (const Tile& tile : tiles) {
    const Box box = view.pixels(tile.lower_mm, tile.upper_mm);
    const Colour colour = level_colour(tile.level, levels);
    // Few thetas of hundreds are to be seen, too.
    const double fullness = std::sqrt(std::sqrt(tile.share));
    if (tile.level + 1 == levels) {
      canvas.fill(corners_of(box), with_alpha(colour, std::lerp(0.4, evaluated_alpha, fullness)));
      continue;
    }
    canvas.fill(corners_of(box), with_alpha(colour, std::lerp(0.05, divided_alpha, fullness)));
    canvas.frame(box, {.colour = with_alpha(colour, 0.8), .width_px = tile.level == 0 ? 1.6 : 1.0});
  }
}

void draw_panel(Canvas& canvas, double left_px, const SearchPanel& panel,
                const std::vector<Tile>& tiles, int levels, const OccupancyGrid& map,
                const PoseLattice& lattice, const glm::dvec2& place_mm) {
  const View view{.box = {left_px, top_px, side_px, side_px},
                  .lower = {lattice.x_mm.lower, lattice.y_mm.lower},
                  .upper = {lattice.x_mm.upper, lattice.y_mm.upper}};
  {
    const Canvas::Clip clip(canvas, view.box);
    draw_occupancy(canvas, view, map);
    draw_tiles(canvas, view, tiles, levels);
    draw_cross(canvas, view.pixel(place_mm));
  }
  draw_axes(canvas, view, even_ticks(view.lower.x, view.upper.x, 7),
            even_ticks(view.lower.y, view.upper.y, 7), "x on the letter, mm",
            left_px < axis_px + 2.0 * margin_px ? "y, mm" : "");
  canvas.text(panel.title, {left_px, top_px - 50.0}, heading);
  canvas.text(panel.caption, {left_px, top_px - 20.0}, small);
}

/// What the colours mean, from left to right.
void draw_legend(Canvas& canvas, int levels, double left_px) {
  constexpr double edge_px = 22.0;
  const auto swatch = [&](int level, const std::string& words) {
    const Box box{left_px, legend_px - 18.0, edge_px, edge_px};
    const Colour colour = level_colour(level, levels);
    const bool last = level + 1 == levels;
    canvas.fill(corners_of(box), with_alpha(colour, last ? evaluated_alpha : divided_alpha));
    canvas.frame(box, {.colour = colour, .width_px = 1.6});
    canvas.text(words, {left_px + edge_px + 10.0, legend_px}, small);
    left_px += edge_px + 10.0 + canvas.text_width(words, small) + 40.0;
  };
  for (int level = 0; level + 1 < levels; ++level) {
    swatch(level, level == 0 ? "large block, looked into" : "smaller block, looked into");
  }
  swatch(levels - 1, "bins evaluated");
  draw_cross(canvas, {left_px + 10.0, legend_px - 7.0});
  canvas.text("where the first touch truly was", {left_px + 30.0, legend_px}, small);
}

}  // namespace

std::string draw_search(const std::vector<SearchPanel>& panels, int object,
                        const OccupancyGrid& map, const PoseLattice& lattice,
                        const glm::dvec2& place_mm) {
  int levels = 1;
  for (const SearchPanel& panel : panels) {
    for (const PoseBlock& block : panel.blocks) {
      levels = std::max(levels, block.level + 1);
    }
  }
  const auto count = static_cast<double>(panels.size());
  const double width_px = 2.0 * margin_px + axis_px + count * side_px + (count - 1.0) * gap_px;
  Canvas canvas(static_cast<int>(width_px), static_cast<int>(height_px));
  double left_px = margin_px + axis_px;
  for (const SearchPanel& panel : panels) {
    draw_panel(canvas, left_px, panel, tiles_of(panel.blocks, object, lattice), levels, map,
               lattice, place_mm);
    left_px += side_px + gap_px;
  }
  draw_legend(canvas, levels, margin_px + axis_px);
  return canvas.encode();
}

std::string draw_refined_blocks(const std::vector<Hypothesis>& letters,
                                const PoseLattice& bins_about_touch) {
  // An unknown whose first touch meets an edge of the letter.
  constexpr std::uint64_t seed = 1'405'000'018;
  constexpr std::size_t shown = 0;  ///< the A
  const Recording unknown = unknown_recordings(1, touches_per_unknown, seed).front();
  // As --pivot-mm auto: x and y are where the first touch lies on the letter.
  PoseLattice lattice = bins_about_touch;
  lattice.pivot_mm = unknown.T_robot_sensor.front().translation_mm;
  BoundedPosterior posterior(letters, {.lattice = lattice});
  const double bins = static_cast<double>(lattice.bins()) * static_cast<double>(letters.size());
  std::vector<SearchPanel> panels;
  std::size_t done = 0;
  for (const std::size_t touches : {std::size_t{1}, std::size_t{3}, std::size_t{9}}) {
    posterior.update(unknown.touches(done, touches));
    done = touches;
    const Estimate estimate = posterior.estimate();
    const auto evaluated = static_cast<double>(estimate.certificate->bins_evaluated);
    panels.push_back(
        {.title = fmt::format("After {} touch{}", touches, touches == 1 ? "" : "es"),
         .caption = fmt::format("{} of {} bins evaluated: {:.2g} %", count_text(evaluated),
                                count_text(bins), 100.0 * evaluated / bins),
         .blocks = posterior.refined_blocks()});
  }
  return draw_search(panels, static_cast<int>(shown), letters[shown].map, lattice,
                     unknown.truth->T_object_robot * lattice.pivot_mm);
}

}  // namespace palpate::bench
