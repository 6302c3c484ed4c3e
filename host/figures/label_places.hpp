#pragma once

#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "figures/canvas.hpp"

namespace palpate {

/// What a label is of and how large it is, in pixels.
struct PlacedLabel {
  Box mark;                 ///< of what it names
  glm::dvec2 size_px{0.0};  ///< of its text
};

/// Places for labels: each as near to its mark as it can be without covering a mark or another
/// label, inside the room; where there is no such place, to the right above its mark.
std::vector<Box> places_of(std::span<const PlacedLabel> labels, std::span<const Box> marks,
                           const Box& room);

}  // namespace palpate
