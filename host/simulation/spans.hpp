#pragma once

#include <vector>

#include "palpate/simulation.hpp"

namespace palpate {

/// An interval of x, in mm.
struct Span {
  double begin;
  double end;
};

/// Returns where the horizontal line at y_mm crosses the shape: disjoint spans in ascending order.
std::vector<Span> spans(const Shape& shape, double y_mm);

}  // namespace palpate
