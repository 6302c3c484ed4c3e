#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include <glm/vec2.hpp>

#include "io/extremes.hpp"

namespace palpate {

/// How far the elements of an array are from each other.
struct ElementSpacing {
  Extremes nearest_mm;                 ///< over the elements: distance to the nearest other element
  std::array<std::size_t, 2> closest;  ///< indices of the two elements with the least distance
};

/// None for fewer than two elements. Takes n sqrt(n) steps for n elements spread over an area.
std::optional<ElementSpacing> spacing_of(std::span<const glm::dvec2> elements_mm);

}  // namespace palpate
