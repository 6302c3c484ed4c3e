#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include <glm/vec2.hpp>

#include "model/extremes.hpp"
#include "palpate/touch.hpp"

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

/// The distance between neighbouring elements, the largest to a nearest one; none where no two
/// elements are apart.
std::optional<double> pitch_of(std::span<const glm::dvec2> elements_mm);

/// The spread of the inverse sensor model where none is given: a quarter of the pitch. It is 0.5 mm
/// without a pitch, and for arrays of about 2 mm, so that DigiTacts and arrays of 2 mm make maps of
/// one spread.
double usual_spread_mm(std::optional<double> pitch_mm);
/// Of the recordings' finest array.
double usual_spread_mm(std::span<const Recording> recordings);

}  // namespace palpate
