#pragma once

#include <vector>

#include "model/bounding_box.hpp"
#include "palpate/simulation.hpp"

namespace palpate {

/// An interval of x, in mm.
struct Span {
  double begin;
  double end;
};

/// True where some triangle of the first vertex and an edge has an area. Otherwise all edges lie on
/// rays from the first vertex, and the polygon encloses nothing.
bool encloses_area(const std::vector<glm::dvec2>& polygon);

/// The box around the shape.
/// @throws Error on a point that is not finite or more than 1 km from the origin, a width out of
/// range, or a shape without area
BoundingBox bounds_of(const Shape& shape);

/// Returns where the horizontal line at y_mm crosses the shape: disjoint spans in ascending order.
std::vector<Span> spans(const Shape& shape, double y_mm);

}  // namespace palpate
