#include "fused_map.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <glm/common.hpp>

#include "bounding_box.hpp"
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

void FusedMap::cover(std::int64_t x, std::int64_t y, std::int64_t nx, std::int64_t ny) {
  const std::int64_t left = nx_ == 0 ? x : std::min(x, x_);
  const std::int64_t low = nx_ == 0 ? y : std::min(y, y_);
  const std::int64_t width = std::max(x + nx, nx_ == 0 ? x + nx : x_ + nx_) - left;
  const std::int64_t height = std::max(y + ny, nx_ == 0 ? y + ny : y_ + ny_) - low;
  if (left == x_ && low == y_ && width == nx_ && height == ny_) {
    return;
  }
  if (width > most_cells / height) {
    throw Error(Fault::input, fmt::format("the map would have {} x {} cells of {} mm; use larger "
                                          "cells",
                                          width, height, options_.cell_mm));
  }
  std::vector<Cell> cells(static_cast<std::size_t>(width * height));
  for (std::int64_t j = 0; j < ny_; ++j) {
    std::copy_n(cells_.begin() + j * nx_, nx_,
                cells.begin() + (j + y_ - low) * width + (x_ - left));
  }
  cells_ = std::move(cells);
  x_ = left;
  y_ = low;
  nx_ = width;
  ny_ = height;
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
  const auto x = static_cast<std::int64_t>(from.x);
  const auto y = static_cast<std::int64_t>(from.y);
  const auto nx = static_cast<std::int64_t>(to.x - from.x) + 1;
  const auto ny = static_cast<std::int64_t>(to.y - from.y) + 1;
  cover(x, y, nx, ny);
  const double prior = log_odds_from_probability(image.prior);
  const Pose T_image_object = inverse(place.T_object_image);
  const glm::dvec2 along = rotate(T_image_object.theta_rad, {1.0, 0.0});
  const glm::dvec2 across(-along.y, along.x);
  for (std::int64_t j = y; j < y + ny; ++j) {
    for (std::int64_t i = x; i < x + nx; ++i) {
      const glm::dvec2 centre =
          options_.cell_mm * glm::dvec2(static_cast<double>(i), static_cast<double>(j));
      glm::dvec2 p = T_image_object.translation_mm + centre.x * along + centre.y * across;
      p.x *= side;
      const ImageSample here = sample(image, prior, (p - image.origin_mm) / image.cell_mm);
      if (here.share < 0.5) {
        continue;
      }
      Cell& cell = cells_[static_cast<std::size_t>((j - y_) * nx_ + i - x_)];
      const double weight = sign * place.weight;
      cell.presses += sign;
      cell.weight += weight;
      cell.evidence += weight * here.evidence / here.share;
      cell.level += weight * here.level / here.share;
    }
  }
}

OccupancyGrid FusedMap::map(const std::string& label) const {
  std::int64_t left = nx_;
  std::int64_t right = -1;
  std::int64_t low = ny_;
  std::int64_t high = -1;
  for (std::int64_t j = 0; j < ny_; ++j) {
    for (std::int64_t i = 0; i < nx_; ++i) {
      if (cells_[static_cast<std::size_t>(j * nx_ + i)].presses > 0) {
        left = std::min(left, i);
        right = std::max(right, i);
        low = std::min(low, j);
        high = j;
      }
    }
  }
  OccupancyGrid map;
  map.label = label;
  map.cell_mm = options_.cell_mm;
  map.prior = options_.sensor.prior;
  map.spread_mm = options_.sensor.spread_mm;
  const double prior = map.prior_log_odds();
  if (right < 0) {
    map.nx = map.ny = 1;
    map.spread_mm = {};
    map.log_odds = {static_cast<float>(prior)};
    map.observations = map.mean_level = {0.0F};
    return map;
  }
  map.origin_mm =
      map.cell_mm * glm::dvec2(static_cast<double>(x_ + left), static_cast<double>(y_ + low));
  map.nx = static_cast<int>(right - left + 1);
  map.ny = static_cast<int>(high - low + 1);
  for (std::int64_t j = low; j <= high; ++j) {
    for (std::int64_t i = left; i <= right; ++i) {
      const Cell& cell = cells_[static_cast<std::size_t>(j * nx_ + i)];
      const bool observed = cell.presses > 0;
      map.log_odds.push_back(
          static_cast<float>(observed ? prior + cell.evidence / cell.weight : prior));
      map.observations.push_back(static_cast<float>(cell.presses));
      map.mean_level.push_back(
          static_cast<float>(observed ? std::max(0.0, cell.level / cell.weight) : 0.0));
    }
  }
  return map;
}

}  // namespace palpate
