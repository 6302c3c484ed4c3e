#include "learning/observed_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "model/bounding_box.hpp"
#include "model/cell_range.hpp"
#include "model/element_spacing.hpp"
#include "model/touch_evidence.hpp"
#include "palpate/contact.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

std::size_t count(const CellRange& cells) { return static_cast<std::size_t>(cells.nx * cells.ny); }

/// A touch's known elements, in the robot frame.
struct KnownTouch {
  const Touch* touch = nullptr;
  std::vector<ElementReading> known;
};

/// Where touches' known elements lie, and how many there are.
struct Extent {
  BoundingBox box;
  std::size_t readings = 0;

  void take_in(const KnownTouch& of) {
    for (const ElementReading& reading : of.known) {
      box.take_in(reading.position_mm);
    }
    readings += of.known.size();
  }
};

/// The sums over touches of all layers of a map.
class Layers {
 public:
  Layers(const CellRange& cells, const MapOptions& options)
      : cells_(cells),
        cell_mm_(options.cell_mm),
        sensor_(options.sensor),
        log_odds_(count(cells), 0.0),
        observations_(count(cells), 0.0),
        level_(count(cells), 0.0) {}

  void add_evidence(const KnownTouch& of, double radius_mm) {
    for (const ElementReading& reading : of.known) {
      visit_near(cells_, cell_mm_, reading.position_mm, radius_mm,
                 [&](std::size_t cell, double squared) {
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
    const CellRange around = cover(box.lower, box.upper, near_mm, cell_mm_);
    std::vector<std::uint8_t> seen(count(around), 0);
    for (const ElementReading& reading : of.known) {
      visit_near(around, cell_mm_, reading.position_mm, near_mm,
                 [&](std::size_t cell, double) { seen[cell] = 1; });
    }
    std::vector<double> weight(count(around), 0.0);
    std::vector<double> weighted(count(around), 0.0);
    for (std::size_t e = 0; e < touch.pressure.size(); ++e) {
      if (!is_living(touch, e)) {
        continue;
      }
      const double pressure = std::max(0.0, touch.pressure[e]);
      visit_near(around, cell_mm_, touch.T_robot_sensor * touch.elements_mm[e], radius_mm,
                 [&](std::size_t cell, double squared) {
                   const double w = std::exp(-squared / (2.0 * deviation_mm * deviation_mm));
                   weight[cell] += w;
                   weighted[cell] += w * pressure;
                 });
    }
    const CellRange both = common(around, cells_);
    for (std::int64_t j = both.y; j < both.y + both.ny; ++j) {
      for (std::int64_t i = both.x; i < both.x + both.nx; ++i) {
        const std::size_t here = around.index(i, j);
        if (seen[here] != 0) {
          const std::size_t cell = cells_.index(i, j);
          observations_[cell] += 1.0;
          level_[cell] += weighted[here] / weight[here];
        }
      }
    }
  }

  Layers& operator+=(const Layers& other) {
    for (std::size_t cell = 0; cell < count(cells_); ++cell) {
      log_odds_[cell] += other.log_odds_[cell];
      observations_[cell] += other.observations_[cell];
      level_[cell] += other.level_[cell];
    }
    return *this;
  }

  /// The layers of some of the cells, in float32.
  void store(const CellRange& cells, OccupancyGrid& map) const {
    const double prior = log_odds_from_probability(sensor_.prior);
    for (std::int64_t j = cells.y; j < cells.y + cells.ny; ++j) {
      for (std::int64_t i = cells.x; i < cells.x + cells.nx; ++i) {
        const std::size_t cell = cells_.index(i, j);
        const double touches = observations_[cell];
        map.log_odds.push_back(static_cast<float>(prior + log_odds_[cell]));
        map.observations.push_back(static_cast<float>(touches));
        map.mean_level.push_back(static_cast<float>(touches > 0.0 ? level_[cell] / touches : 0.0));
      }
    }
  }

 private:
  CellRange cells_;
  double cell_mm_;
  InverseSensorModel sensor_;
  std::vector<double> log_odds_;
  std::vector<double> observations_;
  std::vector<double> level_;  ///< sum over the touches that sensed the cell
};

/// The map of the touches in some layers.
/// @param of the touches
OccupancyGrid map_of(const Layers& layers, const Extent& of, double radius_mm,
                     const MapOptions& options, const std::string& label) {
  if (of.readings == 0) {
    throw Error(Fault::input,
                fmt::format("object '{}': no element of any touch is In Contact or No "
                            "Contact; check the threshold and the pressure's unit",
                            label));
  }
  const CellRange cells = cover(of.box.lower, of.box.upper, radius_mm, options.cell_mm);
  OccupancyGrid map = map_frame(options, label, cells);
  layers.store(cells, map);
  if (const auto fault = fault_of(map)) {
    throw Error(Fault::input, fmt::format("map '{}': {}", label, *fault));
  }
  return map;
}

}  // namespace

ObservedMaps observed_maps(std::span<const Touch> touches, std::span<const std::size_t> part,
                           const MapOptions& options, const std::string& label) {
  options.validate();
  const std::size_t parts = part.empty() ? 1 : *std::ranges::max_element(part) + 1;
  std::vector<std::vector<KnownTouch>> of_part(parts);
  std::vector<Extent> without(parts);
  Extent all;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const KnownTouch touch{&touches[i], known_readings(touches[i], options.classifier)};
    if (const auto fault = fault_of(touch.known)) {
      throw Error(Fault::input, fmt::format("touch {}: {}", i, *fault));
    }
    all.take_in(touch);
    for (std::size_t other = 0; other < parts; ++other) {
      if (other != part[i]) {
        without[other].take_in(touch);
      }
    }
    of_part[part[i]].push_back(touch);
  }
  // The radius of MapBuilder, so that both make maps of the same cells.
  const double radius_mm = support_radius_mm(options.sensor, all.readings);
  const CellRange cells = all.readings == 0
                              ? CellRange{}
                              : cover(all.box.lower, all.box.upper, radius_mm, options.cell_mm);
  std::vector<Layers> layers(parts, Layers(cells, options));
  tbb::parallel_for(std::size_t{0}, parts, [&](std::size_t own) {
    for (const KnownTouch& touch : of_part[own]) {
      layers[own].add_evidence(touch, radius_mm);
      layers[own].add_observation(touch);
    }
  });
  ObservedMaps maps;
  Layers sum(cells, options);
  for (std::size_t own = 0; own < parts; ++own) {
    sum += layers[own];
    Layers others(cells, options);
    for (std::size_t other = 0; other < parts; ++other) {
      if (other != own) {
        others += layers[other];
      }
    }
    const bool only = of_part[own].size() == touches.size();
    maps.without.push_back(only ? OccupancyGrid{}
                                : map_of(others, without[own], radius_mm, options, label));
  }
  maps.all = map_of(sum, all, radius_mm, options, label);
  return maps;
}

OccupancyGrid observed_map(std::span<const Touch> touches, const MapOptions& options,
                           const std::string& label) {
  const std::vector<std::size_t> together(touches.size(), 0);
  return observed_maps(touches, together, options, label).all;
}

}  // namespace palpate
