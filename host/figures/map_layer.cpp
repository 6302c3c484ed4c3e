#include "figures/map_layer.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

void draw_cells(Canvas& canvas, const View& view, const OccupancyGrid& map,
                const EvidenceScale& scale) {
  const double prior = map.prior_log_odds();
  canvas.cells(view.pixels(lower_edge_mm(map), upper_edge_mm(map)), map.nx, map.ny,
               [&](int i, int j) { return scale.colour(map.at(i, j) - prior); });
}

void draw_cells(Canvas& canvas, const View& view, const OccupancyGrid& map,
                const EvidenceScale& scale, const Pose& T_map_view) {
  const auto across = static_cast<int>(view.box.width);
  const auto up = static_cast<int>(view.box.height);
  const double prior = map.prior_log_odds();
  const auto cell_at = [&](double x, double y) {
    return (T_map_view * glm::dvec2(x, y) - map.origin_mm) / map.cell_mm;
  };
  const glm::dvec2 first = cell_at(view.lower.x, view.lower.y);
  const glm::dvec2 along_x = (cell_at(view.upper.x, view.lower.y) - first) / (1.0 * across);
  const glm::dvec2 along_y = (cell_at(view.lower.x, view.upper.y) - first) / (1.0 * up);
  canvas.cells(view.box, across, up, [&](int u, int v) {
    const glm::dvec2 cell = first + (u + 0.5) * along_x + (v + 0.5) * along_y;
    const auto i = static_cast<int>(std::lround(std::clamp(cell.x, -1.0, 1.0 * map.nx)));
    const auto j = static_cast<int>(std::lround(std::clamp(cell.y, -1.0, 1.0 * map.ny)));
    const bool inside = i >= 0 && j >= 0 && i < map.nx && j < map.ny;
    return inside ? scale.colour(map.at(i, j) - prior) : white;
  });
}

void draw_evidence_bar(Canvas& canvas, const Box& box, const EvidenceScale& scale) {
  const double range = scale.range_nats;
  draw_colour_bar(
      canvas, box, -range, range, [&](double nats) { return scale.colour(nats); },
      {{-range, "≤ " + number(-range)},
       {-range / 2, number(-range / 2)},
       {0.0, "prior"},
       {range / 2, "+" + number(range / 2)},
       {range, "≥ +" + number(range)}},
      "log odds relative to the prior, nats");
  const double words = box.top - 9.0;
  canvas.text("← empty", {box.left, words}, body);
  canvas.text("unseen", {box.left + box.width / 2, words}, body, Align::centre);
  canvas.text("occupied →", {box.right(), words}, body, Align::right);
}

}  // namespace palpate
