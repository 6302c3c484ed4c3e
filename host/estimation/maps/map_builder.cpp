#include "palpate/map_builder.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <glm/common.hpp>

#include "estimation/change_in_steps.hpp"
#include "estimation/maps/evidence_grid.hpp"
#include "estimation/maps/left_out_fit.hpp"
#include "model/own_process.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

// Most readings that wait on the host: bounds the memory that a long recording takes.
constexpr std::size_t pending_readings = 1 << 18;

/// Number and bounds of readings.
struct Seen {
  std::size_t readings = 0;
  glm::dvec2 lowest_mm{0.0};
  glm::dvec2 highest_mm{0.0};

  void add(const glm::dvec2& p) {
    if (readings++ == 0) {
      lowest_mm = highest_mm = p;
    }
    lowest_mm = glm::min(lowest_mm, p);
    highest_mm = glm::max(highest_mm, p);
  }
};

}  // namespace

struct MapBuilder::Impl {
  Impl(Device& device, const MapOptions& wanted)
      : options(wanted), grid(device.context(), wanted.cell_mm, wanted.sensor) {}

  double radius_mm(const Seen& all) const {
    return support_radius_mm(options.sensor, all.readings);
  }

  /// Returns the cells of a map of all these readings. Throws Error where they are too many.
  CellRange range_of(const Seen& all) const {
    const CellRange range = cover(all.lowest_mm, all.highest_mm, radius_mm(all), options.cell_mm);
    grid.require_room(range);
    return range;
  }

  void flush() {
    grid.add(pending, radius_mm(seen));
    pending.clear();
  }

  MapOptions options;
  EvidenceGrid grid;
  std::vector<ElementReading> pending;  ///< robot frame = object frame
  Seen seen;                            ///< all readings so far, pending ones too
  ChangeInSteps change{"map: adding touches failed half-way; clear() the builder"};
  OwnProcess process;
};

MapBuilder::MapBuilder(Device& device, const MapOptions& options) {
  options.validate();
  impl_ = std::make_unique<Impl>(device, options);
}

MapBuilder::~MapBuilder() { replace_held(impl_); }
MapBuilder::MapBuilder(MapBuilder&&) noexcept = default;
MapBuilder& MapBuilder::operator=(MapBuilder&& other) noexcept {
  replace_held(impl_, std::move(other.impl_));
  return *this;
}

MapBuilder::Impl& MapBuilder::impl() const { return held_here(impl_, "map builder"); }

void MapBuilder::add(std::span<const Touch> touches) {
  Impl& map = impl();
  map.change.refuse();
  // Every touch is checked before the first is added: one that cannot be mapped refuses all.
  Seen all = map.seen;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const std::vector<ElementReading> known = known_readings(touches[i], map.options.classifier);
    if (const auto fault = fault_of(known)) {
      throw Error(Fault::input, fmt::format("touch {}: {}", i, *fault));
    }
    for (const ElementReading& r : known) {
      all.add(r.position_mm);
    }
  }
  if (all.readings > 0) {
    map.range_of(all);
  }
  map.change.change([&] {
    for (const Touch& touch : touches) {
      for (const ElementReading& r : known_readings(touch, map.options.classifier)) {
        map.seen.add(r.position_mm);
        map.pending.push_back(r);
      }
      if (map.pending.size() >= pending_readings) {
        map.flush();
      }
    }
  });
}

OccupancyGrid MapBuilder::build(const std::string& label) {
  Impl& all = impl();
  all.change.refuse();
  if (all.seen.readings == 0) {
    throw Error(Fault::input,
                fmt::format("object '{}': no element of any touch is In Contact or No "
                            "Contact; check the threshold and the pressure's unit",
                            label));
  }
  all.change.change([&] { all.flush(); });
  const MapOptions& options = all.options;
  const CellRange range = all.range_of(all.seen);
  OccupancyGrid map = map_frame(options, label, range);
  const double prior = map.prior_log_odds();
  for (const double sum : all.grid.sums(range)) {
    map.log_odds.push_back(static_cast<float>(prior + sum));
  }
  if (const auto fault = fault_of(map)) {
    throw Error(Fault::input, fmt::format("map '{}': {}", label, *fault));
  }
  return map;
}

void MapBuilder::clear() {
  Impl& map = impl();
  map.pending.clear();
  map.seen = {};
  map.grid.clear();
  map.change.forget();
}

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
    return same;
  }
  if (!map.source) {
    throw Error(Fault::input,
                fmt::format("map '{}': it holds no touches to build it from again; build it anew",
                            map.label));
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
  if (map.drawn) {
    return built(device, map, prior);
  }
  const OccupancyGrid other = built(device, map, prior);
  if (other.nx != map.nx || other.ny != map.ny) {
    throw Error(
        Fault::input,
        fmt::format("map '{}': its touches make {} x {} cells, but it has {} x {}; build it "
                    "anew",
                    map.label, other.nx, other.ny, map.nx, map.ny));
  }
  OccupancyGrid result = map;
  result.prior = prior;
  result.log_odds = other.log_odds;
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
