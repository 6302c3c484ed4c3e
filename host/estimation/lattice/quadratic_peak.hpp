#pragma once

#include <array>
#include <optional>
#include <span>

#include <glm/vec3.hpp>

namespace palpate {

/// A value at a place, and what it counts for.
struct WeightedValue {
  glm::dvec3 at{0.0};
  double value = 0.0;
  double weight = 0.0;
};

/// Where the quadratic that fits these values best, in weighted least squares, has its maximum.
/// Coordinates that do not vary stay at 0. None where the values do not tell: fewer than two for
/// every unknown, too few different places, or a quadratic without a maximum that stands out.
/// @param least_curvature of the quadratic along each coordinate, in values per coordinate squared
std::optional<glm::dvec3> quadratic_peak(std::span<const WeightedValue> values,
                                         const std::array<bool, 3>& varies, double least_curvature);

}  // namespace palpate
