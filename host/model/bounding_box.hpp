#pragma once

#include <limits>
#include <span>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// The smallest axis-parallel box around points; empty until it takes in a point.
struct BoundingBox {
  glm::dvec2 lower{std::numeric_limits<double>::infinity()};
  glm::dvec2 upper{-std::numeric_limits<double>::infinity()};

  void take_in(const glm::dvec2& p) {
    lower = glm::min(lower, p);
    upper = glm::max(upper, p);
  }
  bool empty() const { return !(lower.x <= upper.x); }
  glm::dvec2 extent() const { return upper - lower; }
  glm::dvec2 middle() const { return (lower + upper) / 2.0; }
  double diagonal() const { return glm::distance(lower, upper); }
};

inline BoundingBox bounding_box(std::span<const glm::dvec2> points) {
  BoundingBox box;
  for (const glm::dvec2& p : points) {
    box.take_in(p);
  }
  return box;
}

/// The box around the cells with log odds above 0, or around the whole map where there are none, in
/// the object frame.
BoundingBox occupied_box(const OccupancyGrid& map);

}  // namespace palpate
