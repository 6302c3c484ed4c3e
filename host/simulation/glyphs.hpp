#pragma once

#include <vector>

#include "palpate/simulation.hpp"

namespace palpate {

/// Returns the strokes of 'A'..'Z' or '0'..'9', 25 mm high and 4.5 mm wide, with the glyph's
/// bounding box centred on the origin; none for any other character.
std::vector<Shape::Stroke> glyph_strokes(char character);

/// Returns an elliptical arc as a polyline, counter-clockwise where to_deg > from_deg.
std::vector<glm::dvec2> arc(const glm::dvec2& centre_mm, const glm::dvec2& radii_mm,
                            double from_deg, double to_deg);

}  // namespace palpate
