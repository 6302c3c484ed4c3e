#include "estimation/bounded/leaves/map_patches.hpp"

#include <cmath>
#include <limits>
#include <unordered_set>

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate {

namespace {

/// A float near the log odds that none of the cells holds.
float unused_float(const OccupancyGrid& map, double log_odds) {
  const auto nearest = static_cast<float>(log_odds);
  const double near = 1e-3 * (1.0 + std::abs(log_odds));
  std::unordered_set<float> used;
  for (const float cell : map.log_odds) {
    if (std::abs(cell - log_odds) < near) {
      used.insert(cell);
    }
  }
  constexpr float infinity = std::numeric_limits<float>::infinity();
  float below = nearest;
  float above = nearest;
  while (used.contains(below) && used.contains(above)) {
    below = std::nextafter(below, -infinity);
    above = std::nextafter(above, infinity);
  }
  return used.contains(below) ? above : below;
}

}  // namespace

MapPatches::MapPatches(const OccupancyGrid& map, double prior)
    : width_(0),
      height_(0),
      prior_log_odds_(log_odds_from_probability(prior)),
      marker_(unused_float(map, prior_log_odds_)) {
  // Kernels hold the index of a node in 32 bits.
  const std::int64_t width = std::int64_t{map.nx} + 2 * border;
  const std::int64_t height = std::int64_t{map.ny} + 2 * border;
  if (width * height > std::numeric_limits<std::int32_t>::max()) {
    throw Error(Fault::input, fmt::format("map \"{}\": {} x {} cells and a border are too many for "
                                          "`filter bounded`; use larger cells",
                                          map.label, map.nx, map.ny));
  }
  width_ = static_cast<int>(width);
  height_ = static_cast<int>(height);
  const auto node = [&](std::int64_t column, std::int64_t row) {
    const std::int64_t i = column - border;
    const std::int64_t j = row - border;
    return i >= 0 && i < map.nx && j >= 0 && j < map.ny
               ? map.at(static_cast<int>(i), static_cast<int>(j))
               : marker_;
  };
  // A vector of 16 floats may start as far as one column and one row into the last patch.
  constexpr std::size_t beyond = side * side;
  nodes_.reserve(static_cast<std::size_t>(width * height) * side + beyond);
  for (std::int64_t y = 0; y < height; ++y) {
    for (std::int64_t x = 0; x < width; ++x) {
      for (int row = 0; row < side; ++row) {
        nodes_.push_back(node(x, y + row));
      }
    }
  }
  nodes_.resize(nodes_.size() + beyond, marker_);
}

}  // namespace palpate
