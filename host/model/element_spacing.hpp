#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include <glm/vec2.hpp>

#include "model/extremes.hpp"

namespace palpate {

/// How far the elements of an array are from each other.
struct ElementSpacing {
  Extremes nearest_mm;                 ///< over the elements: distance to the nearest other element
  std::array<std::size_t, 2> closest;  ///< indices of the two elements with the least distance
};

/// None for fewer than two elements. Takes n sqrt(n) steps for n elements spread over an area.
/// @param alike_mm elements at most so far apart do not count as neighbours; where none has another
/// neighbour, the distances are infinite
std::optional<ElementSpacing> spacing_of(std::span<const glm::dvec2> elements_mm,
                                         double alike_mm = -1.0);

}  // namespace palpate
