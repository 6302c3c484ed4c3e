#pragma once

#include <vector>

#include "palpate/simulation.hpp"

namespace palpate {

/// An interval of x, in mm.
struct Span {
  double begin;
  double end;
};

/// Where the horizontal line at y_mm crosses the shape: disjoint, in ascending order.
std::vector<Span> spans(const Shape& shape, double y_mm);

}  // namespace palpate
