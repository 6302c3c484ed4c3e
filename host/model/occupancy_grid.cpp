#include "palpate/occupancy_grid.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "palpate/pose.hpp"

namespace palpate {

namespace {

bool is_length(double mm) { return mm >= least_length_mm && mm <= most_length_mm; }

bool is_near(const glm::dvec2& p_mm) {
  return std::abs(p_mm.x) <= farthest_mm && std::abs(p_mm.y) <= farthest_mm;
}

}  // namespace

double log_odds_from_probability(double p) { return std::log(p) - std::log1p(-p); }

double probability_from_log_odds(double l) {
  const double z = std::exp(-std::abs(l));
  return (l >= 0 ? 1.0 : z) / (1.0 + z);
}

std::optional<std::string> fault_of(const OccupancyGrid& map) {
  if (std::int64_t{map.nx} * map.ny > most_cells) {
    return fmt::format("{} x {} cells; use at most {}, larger ones", map.nx, map.ny, most_cells);
  }
  if (map.nx < 1 || map.ny < 1 ||
      map.log_odds.size() != static_cast<std::size_t>(map.nx) * static_cast<std::size_t>(map.ny)) {
    return fmt::format("{} x {} cells but {} log odds; make them agree, at least one cell", map.nx,
                       map.ny, map.log_odds.size());
  }
  if (map.label == none_label) {
    return fmt::format("'label' = '{}' is kept for objects that were never learned; choose another",
                       map.label);
  }
  if (!is_length(map.cell_mm)) {
    return fmt::format("'cell_mm' = {}; give {:g} to {:g} mm", map.cell_mm, least_length_mm,
                       most_length_mm);
  }
  if (!is_near(map.origin_mm) || !is_near(map.centre_mm(map.nx - 1, map.ny - 1))) {
    return fmt::format(
        "'origin_mm' = [{}, {}] of {} x {} cells; keep the map within {:g} mm of the "
        "object frame's origin",
        map.origin_mm.x, map.origin_mm.y, map.nx, map.ny, farthest_mm);
  }
  if (!(map.prior > 0.0 && map.prior < 1.0)) {
    return fmt::format("'prior' = {}; make it a probability between 0 and 1", map.prior);
  }
  if (map.symmetry < 0) {
    return fmt::format(
        "'symmetry' = {}; make it 1, n for an n-fold symmetry or 0 for full symmetry",
        map.symmetry);
  }
  // A map reaches several spreads beyond what was touched.
  const double side_mm = map.cell_mm * std::max(map.nx, map.ny);
  if (map.spread_mm && !(is_length(*map.spread_mm) && *map.spread_mm <= side_mm)) {
    return fmt::format(
        "'spread_mm' = {}; give {:g} mm to the grid's longer side of {:g} mm, or "
        "leave it out",
        *map.spread_mm, least_length_mm, side_mm);
  }
  const auto wrong = std::find_if_not(map.log_odds.begin(), map.log_odds.end(), [](float l) {
    return std::abs(l) <= static_cast<float>(most_log_odds);
  });
  if (wrong != map.log_odds.end()) {
    const auto k = wrong - map.log_odds.begin();
    return fmt::format("'log_odds'[{}, {}] = {} in float32; give finite numbers within +-{:g}",
                       k / map.nx, k % map.nx, *wrong, most_log_odds);
  }
  return {};
}

}  // namespace palpate
