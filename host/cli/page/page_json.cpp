#include "cli/page/page_json.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include <fmt/format.h>

#include "figures/evidence_scale.hpp"
#include "figures/palette.hpp"

namespace palpate::cli {

namespace {

std::uint8_t byte(double value) {
  return value > 0.0 ? static_cast<std::uint8_t>(std::lround(std::min(value, 255.0))) : 0;
}

}  // namespace

nlohmann::ordered_json pose_json(const Pose& pose) {
  return {pose.translation_mm.x, pose.translation_mm.y, pose.theta_rad};
}

nlohmann::ordered_json places_json(std::span<const glm::dvec2> places_mm) {
  auto json = nlohmann::ordered_json::array();
  for (const glm::dvec2& p : places_mm) {
    json.push_back({p.x, p.y});
  }
  return json;
}

nlohmann::ordered_json pressure_json(std::span<const double> pressure) {
  auto json = nlohmann::ordered_json::array();
  for (const double value : pressure) {  // what is not finite becomes null
    json.push_back(std::strtod(fmt::format("{:.4g}", value).c_str(), nullptr));
  }
  return json;
}

nlohmann::ordered_json map_json(const OccupancyGrid& map) {
  const double nats = evidence_scale(std::span(&map, 1)).range_nats;
  std::vector<std::uint8_t> evidence;
  evidence.reserve(map.log_odds.size());
  for (const double log_odds : map.log_odds) {
    const double part = (log_odds - map.prior_log_odds()) / nats;
    evidence.push_back(byte(128.0 + 127.0 * std::clamp(part, -1.0, 1.0)));
  }
  const glm::dvec2 lower_mm = map.origin_mm - 0.5 * map.cell_mm;
  return {{"label", map.label},     {"lower_mm", {lower_mm.x, lower_mm.y}},
          {"cell_mm", map.cell_mm}, {"nx", map.nx},
          {"ny", map.ny},           {"nats", nats},
          {"evidence", evidence}};
}

nlohmann::ordered_json belief_json(const PlacedBelief& belief) {
  constexpr double decades = 6.0;
  const double peak = *std::ranges::max_element(belief.xy);
  std::vector<std::uint8_t> xy;
  xy.reserve(belief.xy.size());
  for (const double probability : belief.xy) {
    xy.push_back(byte(255.0 * (1.0 + std::log10(probability / peak) / decades)));
  }
  auto theta = nlohmann::ordered_json::array();
  for (const auto& [theta_rad, probability] : belief.theta) {
    theta.push_back({theta_rad, probability});
  }
  return {{"lower_mm", {belief.lower_mm.x, belief.lower_mm.y}},
          {"cell_mm", belief.cell_mm},
          {"cells", belief.cells},
          {"peak", peak},
          {"xy", xy},
          {"theta", theta}};
}

}  // namespace palpate::cli
