#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include "palpate/pose.hpp"

namespace palpate {

/// Where a function with one minimum in [low, high] is least, by golden sections (Kiefer 1953),
/// within half of `tolerance`; the lowest of several such places.
template <typename Function>
double least_at(double low, double high, double tolerance, const Function& function) {
  constexpr double golden = 0.6180339887498949;
  double left = high - golden * (high - low);
  double right = low + golden * (high - low);
  double at_left = function(left);
  double at_right = function(right);
  while (high - low > tolerance) {
    if (at_left <= at_right) {
      high = right;
      right = left;
      at_right = at_left;
      left = high - golden * (high - low);
      at_left = function(left);
    } else {
      low = left;
      left = right;
      at_left = at_right;
      right = low + golden * (high - low);
      at_right = function(right);
    }
  }
  return (low + high) / 2.0;
}

/// A place and what a function says there.
template <typename Place>
struct Summit {
  Place place{};
  double value = 0.0;
};
/// Goes from a place to the best of its neighbours, and on from there, until none is better.
/// @param neighbours_of(place) lists places; of equals, the first is taken
/// @param value_of(place) is to be large
template <typename Place, typename Neighbours, typename Function>
Summit<Place> climb(Summit<Place> from, const Neighbours& neighbours_of, const Function& value_of) {
  for (bool better = true; better;) {
    better = false;
    for (const Place& place : neighbours_of(from.place)) {
      if (const double value = value_of(place); value > from.value) {
        from = {place, value};
        better = true;
      }
    }
  }
  return from;
}

/// climb() over poses by steps along x, y and theta, which are halved from level to level.
template <typename Function>
Summit<Pose> climb_poses(Summit<Pose> from, Pose step, int levels, const Function& value_of) {
  const auto neighbours_of = [&](const Pose& at) {
    std::vector<Pose> moved;
    for (const double sign : {-1.0, 1.0}) {
      const Pose move{sign * step.translation_mm, sign * step.theta_rad};
      const glm::dvec2& at_mm = at.translation_mm;
      moved.push_back({{at_mm.x + move.translation_mm.x, at_mm.y}, at.theta_rad});
      moved.push_back({{at_mm.x, at_mm.y + move.translation_mm.y}, at.theta_rad});
      moved.push_back({at_mm, at.theta_rad + move.theta_rad});
    }
    return moved;
  };
  for (int level = 0; level < levels; ++level) {
    from = climb(from, neighbours_of, value_of);
    step = {step.translation_mm / 2.0, step.theta_rad / 2.0};
  }
  return from;
}

/// Calls visit(index) for every point of a grid about 0: from -steps to steps along each axis.
template <typename Visit>
void visit_grid(const glm::ivec3& steps, const Visit& visit) {
  for (int z = -steps.z; z <= steps.z; ++z) {
    for (int y = -steps.y; y <= steps.y; ++y) {
      for (int x = -steps.x; x <= steps.x; ++x) {
        visit(glm::dvec3(x, y, z));
      }
    }
  }
}

/// The mean and variance, along each axis, of points whose weights are given by their logs.
struct Moments {
  glm::dvec3 mean{0.0};
  glm::dvec3 variance{0.0};

  explicit Moments(std::span<const std::pair<glm::dvec3, double>> points) {
    double largest = -std::numeric_limits<double>::infinity();
    for (const auto& [at, nats] : points) {
      largest = std::max(largest, nats);
    }
    double sum = 0.0;
    for (const auto& [at, nats] : points) {
      const double weight = std::exp(nats - largest);
      sum += weight;
      mean += weight * at;
      variance += weight * at * at;
    }
    mean /= sum;
    variance = glm::max(variance / sum - mean * mean, 0.0);
  }
};

}  // namespace palpate
