#pragma once

#include <fmt/format.h>

#include "palpate/error.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// The lattice about another pivot.
/// @param filter name of the filter for messages; `touched` says that it has taken in a touch
/// @throws Error where the filter is touched, or on a pivot out of range
inline PoseLattice with_pivot(PoseLattice lattice, const glm::dvec2& pivot_mm, const char* filter,
                              bool touched) {
  if (touched) {
    throw Error(Fault::input,
                fmt::format("{}: its touches are about the pivot {}, {} mm; call reset() before "
                            "the pivot moves",
                            filter, lattice.pivot_mm.x, lattice.pivot_mm.y));
  }
  lattice.pivot_mm = pivot_mm;
  lattice.validate();
  return lattice;
}

}  // namespace palpate
