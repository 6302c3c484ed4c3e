#pragma once

#include <array>
#include <optional>
#include <span>

#include <glm/vec3.hpp>

namespace palpate {

/// A value at a place, and its weight in the fit.
struct WeightedValue {
  glm::dvec3 at{0.0};
  double value = 0.0;
  double weight = 0.0;
};

/// The place of the maximum of the quadratic that fits the values in weighted least squares.
/// Coordinates that do not vary stay at 0. Returns nothing where there are fewer than two values
/// per coefficient, too few different places, or no maximum.
/// @param least_curvature of a maximum, along each coordinate: values per coordinate squared
std::optional<glm::dvec3> quadratic_peak(std::span<const WeightedValue> values,
                                         const std::array<bool, 3>& varies, double least_curvature);

}  // namespace palpate
