#include "palpate/map_builder.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "evidence_grid.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

// Half of what the documentation allows; the rest is for float32.
constexpr double cut_tolerance = 5e-4;
// Readings that wait on the host before they go to the device: what a long recording takes up.
constexpr std::size_t pending_readings = 1 << 18;

}  // namespace

struct MapBuilder::Impl {
  Impl(Device& device, const MapOptions& wanted)
      : options(wanted), grid(device.context(), wanted.cell_mm, wanted.sensor) {}

  /// Radius at which the Gaussian of the next readings is cut off. Reading i may lose
  /// tolerance / (16 max(i, 8192)): together that is below the tolerance up to 10^10 readings.
  double radius_mm() const {
    return options.sensor.support_radius_mm(16 * std::max<std::size_t>(readings, 8192),
                                            cut_tolerance);
  }

  void flush() {
    grid.add(pending, radius_mm());
    pending.clear();
  }

  MapOptions options;
  EvidenceGrid grid;
  std::vector<ElementReading> pending;  ///< robot frame = object frame
  std::size_t readings = 0;             ///< so far, those pending included
  glm::dvec2 lowest_mm{0.0};            ///< of all positions so far
  glm::dvec2 highest_mm{0.0};
};

MapBuilder::MapBuilder(Device& device, const MapOptions& options) {
  if (!(options.cell_mm > 0.0) || !std::isfinite(options.cell_mm)) {
    throw Error(Fault::input,
                fmt::format("cell size = {} mm: give a positive length", options.cell_mm));
  }
  options.sensor.validate();
  impl_ = std::make_unique<Impl>(device, options);
}

MapBuilder::~MapBuilder() = default;
MapBuilder::MapBuilder(MapBuilder&&) noexcept = default;
MapBuilder& MapBuilder::operator=(MapBuilder&&) noexcept = default;

void MapBuilder::add(std::span<const Touch> touches) {
  for (const Touch& touch : touches) {
    for (const ElementReading& r : known_readings(touch, impl_->options.classifier)) {
      const glm::dvec2& p = r.position_mm;
      if (impl_->readings++ == 0) {
        impl_->lowest_mm = impl_->highest_mm = p;
      }
      impl_->lowest_mm = {std::min(impl_->lowest_mm.x, p.x), std::min(impl_->lowest_mm.y, p.y)};
      impl_->highest_mm = {std::max(impl_->highest_mm.x, p.x), std::max(impl_->highest_mm.y, p.y)};
      impl_->pending.push_back(r);
    }
    if (impl_->pending.size() >= pending_readings) {
      impl_->flush();
    }
  }
}

OccupancyGrid MapBuilder::build(const std::string& label) {
  if (impl_->readings == 0) {
    throw Error(Fault::input,
                fmt::format("object '{}': no element of any touch is In Contact or No "
                            "Contact; check the threshold and the pressure's unit",
                            label));
  }
  impl_->flush();
  const MapOptions& options = impl_->options;
  const CellRange range =
      cover(impl_->lowest_mm, impl_->highest_mm, impl_->radius_mm(), options.cell_mm);
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
  const double prior = map.prior_log_odds();
  for (const double sum : impl_->grid.sums(range)) {
    map.log_odds.push_back(static_cast<float>(prior + sum));
  }
  return map;
}

void MapBuilder::clear() {
  impl_->pending.clear();
  impl_->readings = 0;
  impl_->grid.clear();
}

double estimate_prior(Device& device, std::span<const ObjectTouches> objects, MapOptions options) {
  options.sensor.prior = 0.5;
  // Below the map's own tolerance there is no evidence to speak of.
  constexpr double no_evidence = 2.0 * cut_tolerance;
  std::size_t occupied = 0;
  std::size_t modelled = 0;
  MapBuilder builder(device, options);
  for (const ObjectTouches& object : objects) {
    builder.clear();
    builder.add(object.touches);
    for (const float evidence : builder.build(object.label).log_odds) {
      occupied += evidence > no_evidence ? 1 : 0;
      modelled += std::abs(evidence) > no_evidence ? 1 : 0;
    }
  }
  // Where nothing, or everything, was in contact, half a cell keeps the logs finite.
  const double fraction =
      (static_cast<double>(occupied) + 0.5) / (static_cast<double>(modelled) + 1.0);
  return std::clamp(fraction, least_prior, 1.0 - least_prior);
}

}  // namespace palpate
