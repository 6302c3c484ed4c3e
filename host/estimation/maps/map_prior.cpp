#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/vec2.hpp>

#include "estimation/maps/left_out_fit.hpp"
#include "model/cell_range.hpp"
#include "model/refuse.hpp"
#include "palpate/map_builder.hpp"

namespace palpate {

namespace {

/// Occupied area over modelled area, pooled over objects.
class AreaShare {
 public:
  /// Counts the cells of a map built with a prior of 0.5.
  void add(const OccupancyGrid& map) {
    // Evidence below the map's own tolerance counts as none.
    constexpr double no_evidence = 2.0 * map_cut_tolerance;
    // In cells of the first map, so that sums of like maps are whole numbers.
    first_cell_mm_ = first_cell_mm_ > 0.0 ? first_cell_mm_ : map.cell_mm;
    const double cell = std::pow(map.cell_mm / first_cell_mm_, 2.0);
    for (const float evidence : map.log_odds) {
      occupied_ += evidence > no_evidence ? cell : 0.0;
      modelled_ += std::abs(evidence) > no_evidence ? cell : 0.0;
    }
  }

  double share() const {
    require(first_cell_mm_ > 0.0, "objects", 0, "give at least one");
    // Where nothing, or everything, was in contact, half a cell keeps the logs finite.
    const double fraction = (occupied_ + 0.5) / (modelled_ + 1.0);
    return std::clamp(fraction, least_prior, 1.0 - least_prior);
  }

 private:
  double occupied_ = 0.0;
  double modelled_ = 0.0;
  double first_cell_mm_ = 0.0;
};

OccupancyGrid built(Device& device, const OccupancyGrid& map, double prior) {
  if (map.drawn) {
    OccupancyGrid same = map;
    same.prior = prior;
    require_sound_map(same);
    return same;
  }
  if (!map.source) {
    refuse(fmt::format("map '{}'", map.label),
           "it holds no touches to build it from again; build it anew");
  }
  MapOptions options = map.source->options;
  options.sensor.prior = prior;
  MapBuilder builder(device, options);
  const Recording& touches = map.source->touches;
  builder.add(touches.touches(0, touches.size()));
  return builder.build(map.label);
}

}  // namespace

OccupancyGrid with_prior(Device& device, const OccupancyGrid& map, double prior) {
  OccupancyGrid other = built(device, map, prior);
  if (map.drawn) {
    return other;
  }
  OccupancyGrid result = map;
  result.prior = prior;
  // How far a reading is felt depends on the prior: the other map may have a row more or less.
  glm::ivec2 from(0);
  if (other.nx != map.nx || other.ny != map.ny) {
    const glm::dvec2 own_mm = built(device, map, map.prior).origin_mm;  // in the touches' frame
    from = glm::round((own_mm - other.origin_mm) / map.cell_mm);
  }
  auto cell = result.log_odds.begin();
  for (int y = from.y; y < from.y + map.ny; ++y) {
    for (int x = from.x; x < from.x + map.nx; ++x) {
      const bool is_felt = x >= 0 && y >= 0 && x < other.nx && y < other.ny;
      *cell++ = is_felt ? other.at(x, y) : static_cast<float>(other.prior_log_odds());
    }
  }
  auto source = std::make_shared<MapSource>(*map.source);
  source->options.sensor.prior = prior;
  if (map.source->left_out) {
    judge_left_out(device, *source);
  }
  result.source = std::move(source);
  return result;
}

double pooled_prior(Device& device, std::span<const OccupancyGrid> maps) {
  AreaShare share;
  for (const OccupancyGrid& map : maps) {
    share.add(built(device, map, 0.5));
  }
  return share.share();
}

double estimate_prior(Device& device, std::span<const ObjectTouches> objects, MapOptions options) {
  options.sensor.prior = 0.5;
  AreaShare share;
  MapBuilder builder(device, options);
  for (const ObjectTouches& object : objects) {
    builder.clear();
    builder.add(object.touches);
    share.add(builder.build(object.label));
  }
  return share.share();
}

}  // namespace palpate
