#pragma once

#include <vector>

#include "palpate/simulation.hpp"

namespace palpate {

/// The strokes of 'A'..'Z' or '0'..'9': 25 mm high, 4.5 mm wide, the glyph's bounding box centred
/// on the origin. Empty for any other character.
std::vector<Shape::Stroke> glyph_strokes(char character);

/// An elliptical arc as a polyline, counter-clockwise where to_deg > from_deg.
std::vector<glm::dvec2> arc(const glm::dvec2& centre_mm, const glm::dvec2& radii_mm,
                            double from_deg, double to_deg);

}  // namespace palpate
