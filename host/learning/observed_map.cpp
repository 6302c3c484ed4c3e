#include "learning/observed_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <glm/common.hpp>

#include "model/bounding_box.hpp"
#include "model/element_spacing.hpp"
#include "model/refuse.hpp"
#include "model/touch_evidence.hpp"
#include "palpate/contact.hpp"

namespace palpate {

namespace {

std::size_t count(const CellRange& cells) { return static_cast<std::size_t>(cells.nx * cells.ny); }

/// Calls visit(i, j) for every cell of a range, row by row.
template <typename Visit>
void visit_cells(const CellRange& cells, const Visit& visit) {
  for (std::int64_t j = cells.y; j < cells.y + cells.ny; ++j) {
    for (std::int64_t i = cells.x; i < cells.x + cells.nx; ++i) {
      visit(i, j);
    }
  }
}

/// What an image says at a place.
struct ImageSample {
  double share = 0.0;  ///< bilinear weight of the observed cells
  double evidence = 0.0;
  double level = 0.0;
};

/// @param place in cells
ImageSample sample(const OccupancyGrid& image, double prior, const glm::dvec2& place) {
  ImageSample result;
  const glm::dvec2 first = glm::floor(place);
  if (!(first.x >= -1.0 && first.x < image.nx && first.y >= -1.0 && first.y < image.ny)) {
    return result;
  }
  const glm::dvec2 f = place - first;
  for (const int dy : {0, 1}) {
    for (const int dx : {0, 1}) {
      const int i = static_cast<int>(first.x) + dx;
      const int j = static_cast<int>(first.y) + dy;
      const std::size_t k = static_cast<std::size_t>(j) * image.nx + static_cast<std::size_t>(i);
      if (i < 0 || i >= image.nx || j < 0 || j >= image.ny || image.observations[k] <= 0.0F) {
        continue;
      }
      const double share = (dx == 1 ? f.x : 1.0 - f.x) * (dy == 1 ? f.y : 1.0 - f.y);
      result.share += share;
      result.evidence += share * (image.log_odds[k] - prior);
      result.level += share * image.mean_level[k];
    }
  }
  return result;
}

}  // namespace

MapSums::MapSums(const MapOptions& options, const CellRange& range)
    : options_(options), range_(range), cells_(count(range)) {}

void MapSums::add(const Touch& touch, std::span<const ElementReading> known, double radius_mm) {
  const InverseSensorModel& sensor = options_.sensor;
  const double cell_mm = options_.cell_mm;
  for (const ElementReading& reading : known) {
    visit_near(range_, cell_mm, reading.position_mm, radius_mm,
               [&](std::size_t cell, double squared) {
                 cells_[cell].evidence += sensor.increment(reading.reading, std::sqrt(squared));
               });
  }
  if (known.empty()) {
    return;
  }
  // Around the touch alone, so that many touches over a large map take no more than their area.
  BoundingBox box;
  for (const ElementReading& reading : known) {
    box.take_in(reading.position_mm);
    touched_.take_in(reading.position_mm);
  }
  const auto spacing = spacing_of(touch.elements_mm);
  const double near_mm = spacing ? spacing->nearest_mm.most : 2.0 * sensor.spread_mm;
  const double deviation_mm = std::max(sensor.spread_mm, near_mm / 4.0);
  const double level_radius_mm = std::max(near_mm, 4.0 * deviation_mm);
  const CellRange around = cover(box.lower, box.upper, near_mm, cell_mm);
  struct Observed {
    bool seen = false;
    double weight = 0.0;
    double weighted = 0.0;
  };
  std::vector<Observed> observed(count(around));
  for (const ElementReading& reading : known) {
    visit_near(around, cell_mm, reading.position_mm, near_mm,
               [&](std::size_t cell, double) { observed[cell].seen = true; });
  }
  for (std::size_t e = 0; e < touch.pressure.size(); ++e) {
    if (!is_living(touch, e)) {
      continue;
    }
    const double pressure = std::max(0.0, touch.pressure[e]);
    visit_near(around, cell_mm, touch.T_robot_sensor * touch.elements_mm[e], level_radius_mm,
               [&](std::size_t cell, double squared) {
                 const double w = std::exp(-squared / (2.0 * deviation_mm * deviation_mm));
                 observed[cell].weight += w;
                 observed[cell].weighted += w * pressure;
               });
  }
  visit_cells(common(around, range_), [&](std::int64_t i, std::int64_t j) {
    if (const Observed& here = observed[around.index(i, j)]; here.seen) {
      Cell& cell = cells_[range_.index(i, j)];
      cell.level += here.weighted / here.weight;
      cell.weight += 1.0;
      ++cell.touches;
    }
  });
}

void MapSums::make_room(const CellRange& needed) {
  if (range_.contains(needed)) {
    return;
  }
  const CellRange larger = united(range_, needed);
  if (larger.nx > most_cells / larger.ny) {
    throw Error(Fault::input, fmt::format("the map would have {} x {} cells of {} mm; use larger "
                                          "cells",
                                          larger.nx, larger.ny, options_.cell_mm));
  }
  std::vector<Cell> cells(count(larger));
  visit_cells(range_, [&](std::int64_t i, std::int64_t j) {
    cells[larger.index(i, j)] = cells_[range_.index(i, j)];
  });
  cells_ = std::move(cells);
  range_ = larger;
}

void MapSums::change(const OccupancyGrid& image, const ImagePlace& place, int sign) {
  const double side = place.mirrored ? -1.0 : 1.0;
  BoundingBox box;
  for (const int j : {0, image.ny - 1}) {
    for (const int i : {0, image.nx - 1}) {
      const glm::dvec2 corner = image.centre_mm(i, j);
      box.take_in(place.T_object_image * glm::dvec2(side * corner.x, corner.y) / options_.cell_mm);
    }
  }
  // Cells of images on the map's own cells, but for rounding, are the map's.
  constexpr double rounding = 1e-6;
  const glm::dvec2 from = glm::ceil(box.lower - rounding);
  const glm::dvec2 to = glm::floor(box.upper + rounding);
  const CellRange covered{static_cast<std::int64_t>(from.x), static_cast<std::int64_t>(from.y),
                          static_cast<std::int64_t>(to.x - from.x) + 1,
                          static_cast<std::int64_t>(to.y - from.y) + 1};
  make_room(covered);
  const double prior = log_odds_from_probability(image.prior);
  const Pose T_image_object = inverse(place.T_object_image);
  const glm::dvec2 along = rotate(T_image_object.theta_rad, {1.0, 0.0});
  const glm::dvec2 across(-along.y, along.x);
  visit_cells(covered, [&](std::int64_t i, std::int64_t j) {
    const glm::dvec2 centre =
        options_.cell_mm * glm::dvec2(static_cast<double>(i), static_cast<double>(j));
    glm::dvec2 p = T_image_object.translation_mm + centre.x * along + centre.y * across;
    p.x *= side;
    const ImageSample here = sample(image, prior, (p - image.origin_mm) / image.cell_mm);
    if (here.share >= 0.5) {
      Cell& cell = cells_[range_.index(i, j)];
      const double weight = sign * place.weight;
      cell.touches += sign;
      cell.weight += weight;
      cell.evidence += weight * here.evidence / here.share;
      cell.level += weight * here.level / here.share;
    }
  });
}

MapSums& MapSums::operator+=(const MapSums& other) {
  if (!other.touched_.empty()) {
    touched_.take_in(other.touched_.lower);
    touched_.take_in(other.touched_.upper);
  }
  for (std::size_t k = 0; k < cells_.size(); ++k) {
    cells_[k].evidence += other.cells_[k].evidence;
    cells_[k].level += other.cells_[k].level;
    cells_[k].weight += other.cells_[k].weight;
    cells_[k].touches += other.cells_[k].touches;
  }
  return *this;
}

OccupancyGrid MapSums::map(const std::string& label, const CellRange& range, bool mean) const {
  OccupancyGrid map = map_frame(options_, label, range);
  const double prior = map.prior_log_odds();
  visit_cells(range, [&](std::int64_t i, std::int64_t j) {
    const Cell& cell = cells_[range_.index(i, j)];
    const bool seen = cell.touches > 0;
    const double evidence = !mean ? cell.evidence : seen ? cell.evidence / cell.weight : 0.0;
    map.log_odds.push_back(static_cast<float>(prior + evidence));
    map.observations.push_back(static_cast<float>(cell.touches));
    map.mean_level.push_back(
        static_cast<float>(seen ? std::max(0.0, cell.level / cell.weight) : 0.0));
  });
  return map;
}

OccupancyGrid MapSums::sum(const std::string& label, double radius_mm) const {
  if (touched_.empty()) {
    refuse(fmt::format("object '{}'", label),
           "no element of any touch is In Contact or No Contact; check the threshold and the "
           "pressure's unit");
  }
  OccupancyGrid sum =
      map(label, cover(touched_.lower, touched_.upper, radius_mm, options_.cell_mm), false);
  if (const auto fault = fault_of(sum)) {
    throw Error(Fault::input, fmt::format("map '{}': {}", label, *fault));
  }
  return sum;
}

OccupancyGrid MapSums::mean(const std::string& label) const {
  CellRange observed;
  visit_cells(range_, [&](std::int64_t i, std::int64_t j) {
    if (cells_[range_.index(i, j)].touches > 0) {
      observed = united(observed, {i, j, 1, 1});
    }
  });
  if (observed.nx > 0) {
    return map(label, observed, true);
  }
  OccupancyGrid nothing = MapSums(options_, {0, 0, 1, 1}).map(label, {0, 0, 1, 1}, true);
  nothing.spread_mm = {};
  return nothing;
}

ObservedMaps observed_maps(std::span<const Touch> touches, std::span<const std::size_t> part,
                           const MapOptions& options, const std::string& label) {
  options.validate();
  std::vector<std::vector<ElementReading>> known;
  BoundingBox box;
  std::size_t readings = 0;
  for (const Touch& touch : touches) {
    known.push_back(known_readings(touch, options.classifier));
    if (const auto fault = fault_of(known.back())) {
      throw Error(Fault::input, fmt::format("touch {}: {}", known.size() - 1, *fault));
    }
    for (const ElementReading& reading : known.back()) {
      box.take_in(reading.position_mm);
    }
    readings += known.back().size();
  }
  // The radius of MapBuilder, so that both make maps of the same cells.
  const double radius_mm = support_radius_mm(options.sensor, readings);
  const MapSums none(
      options, box.empty() ? CellRange{} : cover(box.lower, box.upper, radius_mm, options.cell_mm));
  std::vector<MapSums> sums(part.empty() ? 1 : *std::ranges::max_element(part) + 1, none);
  tbb::parallel_for(std::size_t{0}, sums.size(), [&](std::size_t own) {
    for (std::size_t i = 0; i < touches.size(); ++i) {
      if (part[i] == own) {
        sums[own].add(touches[i], known[i], radius_mm);
      }
    }
  });
  const auto sum_without = [&](std::optional<std::size_t> left_out) {
    MapSums sum = none;
    for (std::size_t k = 0; k < sums.size(); ++k) {
      if (k != left_out) {
        sum += sums[k];
      }
    }
    return sum.sum(label, radius_mm);
  };
  ObservedMaps maps{.all = sum_without({}), .without = {}};
  for (std::size_t own = 0; own < sums.size(); ++own) {
    const bool only = std::ranges::all_of(part, [&](std::size_t of) { return of == own; });
    maps.without.push_back(only ? OccupancyGrid{} : sum_without(own));
  }
  return maps;
}

OccupancyGrid observed_map(std::span<const Touch> touches, const MapOptions& options,
                           const std::string& label) {
  const std::vector<std::size_t> one_part(touches.size(), 0);
  return observed_maps(touches, one_part, options, label).all;
}

}  // namespace palpate
