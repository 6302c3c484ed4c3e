#pragma once

#include <array>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

namespace palpate {

/// The area that one touch covers, in mm, in the frame of the element centres it is made from.
struct Footprint {
  std::vector<std::array<glm::dvec2, 4>> elements;  ///< a square each
  std::vector<glm::dvec2> outline;                  ///< their convex hull, counter-clockwise
};

/// Squares of edge `element_mm` around the centres, turned as the smallest rectangle that holds
/// all of them: for a rectangular array, as the array.
Footprint footprint(std::span<const glm::dvec2> centres_mm, double element_mm);

}  // namespace palpate
