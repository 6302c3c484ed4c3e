#include "map_layer.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate {

namespace {

/// Evidence below this is a remnant of a Gaussian's tail.
constexpr double least_evidence_nats = 0.01;

/// The next larger number whose half is short, too.
double round_up(double value) {
  const double decade = std::pow(10.0, std::floor(std::log10(value)));
  for (const double factor : {1.0, 2.0, 4.0, 6.0, 8.0}) {
    if (factor * decade >= value) {
      return factor * decade;
    }
  }
  return 10.0 * decade;
}

}  // namespace

void require_cells(const OccupancyGrid& map) {
  if (map.nx < 1 || map.ny < 1 ||
      map.log_odds.size() != static_cast<std::size_t>(map.nx) * map.ny) {
    throw Error(Fault::input, fmt::format("map '{}': {} values for {} x {} cells: nothing to draw, "
                                          "build the map from touches first",
                                          map.label, map.log_odds.size(), map.nx, map.ny));
  }
}

glm::dvec2 lower_edge_mm(const OccupancyGrid& map) { return map.origin_mm - 0.5 * map.cell_mm; }

glm::dvec2 upper_edge_mm(const OccupancyGrid& map) {
  return lower_edge_mm(map) + map.cell_mm * glm::dvec2(map.nx, map.ny);
}

EvidenceScale evidence_scale(std::span<const OccupancyGrid> maps) {
  std::vector<double> strengths;
  for (const OccupancyGrid& map : maps) {
    const double prior = map.prior_log_odds();
    for (const float log_odds : map.log_odds) {
      const double strength = std::abs(log_odds - prior);
      if (strength >= least_evidence_nats && std::isfinite(strength)) {
        strengths.push_back(strength);
      }
    }
  }
  if (strengths.empty()) {
    return {};
  }
  const auto ninth = strengths.begin() + static_cast<std::ptrdiff_t>(strengths.size() * 9 / 10);
  std::nth_element(strengths.begin(), ninth, strengths.end());
  return {round_up(*ninth)};
}

void draw_cells(Canvas& canvas, const View& view, const OccupancyGrid& map,
                const EvidenceScale& scale) {
  const double prior = map.prior_log_odds();
  canvas.cells(view.pixels(lower_edge_mm(map), upper_edge_mm(map)), map.nx, map.ny,
               [&](int i, int j) { return scale.colour(map.at(i, j) - prior); });
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
