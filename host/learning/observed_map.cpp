#include "observed_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <fmt/format.h>

#include "bounding_box.hpp"
#include "element_spacing.hpp"
#include "palpate/contact.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

/// Cells [x, x + nx) x [y, y + ny), where cell (i, j) is centred at cell_mm * (i, j).
struct Cells {
  double cell_mm = 0.0;
  std::int64_t x = 0;
  std::int64_t y = 0;
  std::int64_t nx = 0;
  std::int64_t ny = 0;

  std::size_t count() const { return static_cast<std::size_t>(nx * ny); }

  /// Calls visit(index, squared distance in mm^2) for every cell whose centre lies within
  /// `radius_mm` of a place.
  template <typename Visit>
  void visit_near(const glm::dvec2& place_mm, double radius_mm, const Visit& visit) const {
    const auto from = [&](double mm, std::int64_t first) {
      return std::max(first, static_cast<std::int64_t>(std::ceil((mm - radius_mm) / cell_mm)));
    };
    const auto to = [&](double mm, std::int64_t end) {
      return std::min(end - 1, static_cast<std::int64_t>(std::floor((mm + radius_mm) / cell_mm)));
    };
    for (std::int64_t j = from(place_mm.y, y); j <= to(place_mm.y, y + ny); ++j) {
      const double dy = cell_mm * static_cast<double>(j) - place_mm.y;
      for (std::int64_t i = from(place_mm.x, x); i <= to(place_mm.x, x + nx); ++i) {
        const double dx = cell_mm * static_cast<double>(i) - place_mm.x;
        if (const double squared = dx * dx + dy * dy; squared <= radius_mm * radius_mm) {
          visit(static_cast<std::size_t>((j - y) * nx + i - x), squared);
        }
      }
    }
  }
};

/// The cells whose centres lie within `margin_mm` of a box; at least one.
Cells cells_around(const BoundingBox& box, double margin_mm, double cell_mm) {
  const glm::dvec2 first = glm::ceil((box.lower - margin_mm) / cell_mm);
  const glm::dvec2 last = glm::floor((box.upper + margin_mm) / cell_mm);
  const glm::dvec2 count = glm::max(glm::dvec2(1.0), last - first + 1.0);
  if (!(count.x * count.y <= static_cast<double>(most_cells))) {
    throw Error(Fault::input,
                fmt::format("the map would have {:.3g} x {:.3g} cells of {} mm; use larger cells, "
                            "or touches that lie closer together",
                            count.x, count.y, cell_mm));
  }
  return {cell_mm, static_cast<std::int64_t>(first.x), static_cast<std::int64_t>(first.y),
          static_cast<std::int64_t>(count.x), static_cast<std::int64_t>(count.y)};
}

/// A touch's known elements, in the robot frame.
struct KnownTouch {
  const Touch* touch = nullptr;
  std::vector<ElementReading> known;
};

/// The sums over touches of all layers of a map.
class Layers {
 public:
  Layers(const Cells& cells, const InverseSensorModel& sensor)
      : cells_(cells),
        sensor_(sensor),
        log_odds_(cells.count(), log_odds_from_probability(sensor.prior)),
        observations_(cells.count(), 0.0),
        level_(cells.count(), 0.0) {}

  void add_evidence(const KnownTouch& of, double radius_mm) {
    for (const ElementReading& reading : of.known) {
      cells_.visit_near(reading.position_mm, radius_mm, [&](std::size_t cell, double squared) {
        log_odds_[cell] += sensor_.increment(reading.reading, std::sqrt(squared));
      });
    }
  }

  void add_observation(const KnownTouch& of) {
    if (of.known.empty()) {
      return;
    }
    const Touch& touch = *of.touch;
    const auto spacing = spacing_of(touch.elements_mm);
    const double near_mm = spacing ? spacing->nearest_mm.most : 2.0 * sensor_.spread_mm;
    const double deviation_mm = std::max(sensor_.spread_mm, near_mm / 4.0);
    const double radius_mm = std::max(near_mm, 4.0 * deviation_mm);
    // Around the touch alone, so that many touches over a large map take no more than their area.
    BoundingBox box;
    for (const ElementReading& reading : of.known) {
      box.take_in(reading.position_mm);
    }
    const Cells around = cells_around(box, near_mm, cells_.cell_mm);
    std::vector<std::uint8_t> seen(around.count(), 0);
    for (const ElementReading& reading : of.known) {
      around.visit_near(reading.position_mm, near_mm,
                        [&](std::size_t cell, double) { seen[cell] = 1; });
    }
    std::vector<double> weight(around.count(), 0.0);
    std::vector<double> weighted(around.count(), 0.0);
    for (std::size_t e = 0; e < touch.pressure.size(); ++e) {
      const bool living = touch.valid.empty() || touch.valid[e] != 0;
      if (!living || std::isnan(touch.pressure[e])) {
        continue;
      }
      const double pressure = std::max(0.0, touch.pressure[e]);
      around.visit_near(touch.T_robot_sensor * touch.elements_mm[e], radius_mm,
                        [&](std::size_t cell, double squared) {
                          const double w = std::exp(-squared / (2.0 * deviation_mm * deviation_mm));
                          weight[cell] += w;
                          weighted[cell] += w * pressure;
                        });
    }
    for (std::int64_t j = std::max(around.y, cells_.y);
         j < std::min(around.y + around.ny, cells_.y + cells_.ny); ++j) {
      for (std::int64_t i = std::max(around.x, cells_.x);
           i < std::min(around.x + around.nx, cells_.x + cells_.nx); ++i) {
        const auto here = static_cast<std::size_t>((j - around.y) * around.nx + i - around.x);
        if (seen[here] != 0) {
          const auto cell = static_cast<std::size_t>((j - cells_.y) * cells_.nx + i - cells_.x);
          observations_[cell] += 1.0;
          level_[cell] += weighted[here] / weight[here];
        }
      }
    }
  }

  /// The map's cells, in float32.
  void store(OccupancyGrid& map) const {
    for (std::size_t cell = 0; cell < cells_.count(); ++cell) {
      const double touches = observations_[cell];
      map.log_odds.push_back(static_cast<float>(log_odds_[cell]));
      map.observations.push_back(static_cast<float>(touches));
      map.mean_level.push_back(static_cast<float>(touches > 0.0 ? level_[cell] / touches : 0.0));
    }
  }

 private:
  Cells cells_;
  InverseSensorModel sensor_;
  std::vector<double> log_odds_;
  std::vector<double> observations_;
  std::vector<double> level_;  ///< sum over the touches that sensed the cell
};

void validate(const MapOptions& options) {
  if (!(options.cell_mm >= least_length_mm && options.cell_mm <= most_length_mm)) {
    throw Error(Fault::input, fmt::format("cell size = {} mm: give {:g} to {:g} mm",
                                          options.cell_mm, least_length_mm, most_length_mm));
  }
  options.sensor.validate();
  options.classifier.validate();
}

}  // namespace

OccupancyGrid observed_map(std::span<const Touch> touches, const MapOptions& options,
                           const std::string& label) {
  validate(options);
  // The radius of MapBuilder, so that both make maps of the same cells.
  constexpr std::size_t least_readings = 8192;
  constexpr double cut_tolerance = 5e-4;
  std::vector<KnownTouch> all;
  std::size_t readings = 0;
  BoundingBox box;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    all.push_back({&touches[i], known_readings(touches[i], options.classifier)});
    if (const auto fault = fault_of(all.back().known)) {
      throw Error(Fault::input, fmt::format("touch {}: {}", i, *fault));
    }
    for (const ElementReading& reading : all.back().known) {
      box.take_in(reading.position_mm);
      ++readings;
    }
  }
  if (readings == 0) {
    throw Error(Fault::input,
                fmt::format("object '{}': no element of any touch is In Contact or No "
                            "Contact; check the threshold and the pressure's unit",
                            label));
  }
  const double radius_mm =
      options.sensor.support_radius_mm(16 * std::max(readings, least_readings), cut_tolerance);
  const Cells cells = cells_around(box, radius_mm, options.cell_mm);
  Layers layers(cells, options.sensor);
  for (const KnownTouch& touch : all) {
    layers.add_evidence(touch, radius_mm);
    layers.add_observation(touch);
  }
  OccupancyGrid map;
  map.label = label;
  map.prior = options.sensor.prior;
  map.cell_mm = options.cell_mm;
  map.spread_mm = options.sensor.spread_mm;
  map.origin_mm =
      options.cell_mm * glm::dvec2(static_cast<double>(cells.x), static_cast<double>(cells.y));
  map.nx = static_cast<int>(cells.nx);
  map.ny = static_cast<int>(cells.ny);
  layers.store(map);
  if (const auto fault = fault_of(map)) {
    throw Error(Fault::input, fmt::format("map '{}': {}", label, *fault));
  }
  return map;
}

}  // namespace palpate
