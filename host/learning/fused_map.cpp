#include "learning/fused_map.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <glm/common.hpp>

#include "model/bounding_box.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

/// What an image says at a place.
struct ImageSample {
  double share = 0.0;  ///< bilinear weight of the observed cells
  double evidence = 0.0;
  double level = 0.0;
};

/// @param place in cells
ImageSample sample(const PressImage& image, double prior, const glm::dvec2& place) {
  ImageSample result;
  const double column = std::floor(place.x);
  const double row = std::floor(place.y);
  if (!(column >= -1.0 && column < image.nx && row >= -1.0 && row < image.ny)) {
    return result;
  }
  for (const int dy : {0, 1}) {
    for (const int dx : {0, 1}) {
      const int i = static_cast<int>(column) + dx;
      const int j = static_cast<int>(row) + dy;
      if (i < 0 || i >= image.nx || j < 0 || j >= image.ny) {
        continue;
      }
      const std::size_t k = static_cast<std::size_t>(j) * image.nx + static_cast<std::size_t>(i);
      if (image.observations[k] <= 0.0F) {
        continue;
      }
      const double fx = place.x - column;
      const double fy = place.y - row;
      const double share = (dx == 1 ? fx : 1.0 - fx) * (dy == 1 ? fy : 1.0 - fy);
      result.share += share;
      result.evidence += share * (image.log_odds[k] - prior);
      result.level += share * image.mean_level[k];
    }
  }
  return result;
}

}  // namespace

void FusedMap::make_room(const CellRange& needed) {
  if (range_.contains(needed)) {
    return;
  }
  const CellRange larger = united(range_, needed);
  if (larger.nx > most_cells / larger.ny) {
    throw Error(Fault::input, fmt::format("the map would have {} x {} cells of {} mm; use larger "
                                          "cells",
                                          larger.nx, larger.ny, options_.cell_mm));
  }
  std::vector<Cell> cells(static_cast<std::size_t>(larger.nx * larger.ny));
  for (std::int64_t j = 0; j < range_.ny; ++j) {
    std::copy_n(cells_.begin() + j * range_.nx, range_.nx,
                cells.begin() + static_cast<std::ptrdiff_t>(larger.index(range_.x, range_.y + j)));
  }
  cells_ = std::move(cells);
  range_ = larger;
}

void FusedMap::change(const PressImage& image, const ImagePlace& place, int sign) {
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
  for (std::int64_t j = covered.y; j < covered.y + covered.ny; ++j) {
    for (std::int64_t i = covered.x; i < covered.x + covered.nx; ++i) {
      const glm::dvec2 centre =
          options_.cell_mm * glm::dvec2(static_cast<double>(i), static_cast<double>(j));
      glm::dvec2 p = T_image_object.translation_mm + centre.x * along + centre.y * across;
      p.x *= side;
      const ImageSample here = sample(image, prior, (p - image.origin_mm) / image.cell_mm);
      if (here.share < 0.5) {
        continue;
      }
      Cell& cell = cells_[range_.index(i, j)];
      const double weight = sign * place.weight;
      cell.presses += sign;
      cell.weight += weight;
      cell.evidence += weight * here.evidence / here.share;
      cell.level += weight * here.level / here.share;
    }
  }
}

OccupancyGrid FusedMap::map(const std::string& label) const {
  CellRange observed;
  for (std::int64_t j = range_.y; j < range_.y + range_.ny; ++j) {
    for (std::int64_t i = range_.x; i < range_.x + range_.nx; ++i) {
      if (cells_[range_.index(i, j)].presses > 0) {
        observed = united(observed, {i, j, 1, 1});
      }
    }
  }
  const bool nothing = observed.nx == 0;
  OccupancyGrid map = map_frame(options_, label, nothing ? CellRange{0, 0, 1, 1} : observed);
  const double prior = map.prior_log_odds();
  if (nothing) {
    map.spread_mm = {};
    map.log_odds = {static_cast<float>(prior)};
    map.observations = map.mean_level = {0.0F};
    return map;
  }
  for (std::int64_t j = observed.y; j < observed.y + observed.ny; ++j) {
    for (std::int64_t i = observed.x; i < observed.x + observed.nx; ++i) {
      const Cell& cell = cells_[range_.index(i, j)];
      const bool seen = cell.presses > 0;
      map.log_odds.push_back(
          static_cast<float>(seen ? prior + cell.evidence / cell.weight : prior));
      map.observations.push_back(static_cast<float>(cell.presses));
      map.mean_level.push_back(
          static_cast<float>(seen ? std::max(0.0, cell.level / cell.weight) : 0.0));
    }
  }
  return map;
}

}  // namespace palpate
