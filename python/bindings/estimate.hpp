#pragma once

#include <optional>
#include <span>
#include <vector>

#include "arrays.hpp"
#include "palpate/estimate.hpp"
#include "palpate/touch.hpp"

namespace palpate::python {

/// Gains of every candidate.
struct TouchGains {
  std::vector<TouchGain> each;
};

/// Maps, as OccupancyGrid or Hypothesis.
struct MapsLike : nb::object {
  NB_OBJECT_DEFAULT(MapsLike, nb::object, "collections.abc.Iterable[OccupancyGrid | Hypothesis]",
                    any_object)
};
std::vector<Hypothesis> hypotheses_of(nb::handle maps);
/// The hypothesis that an OccupancyGrid or a Hypothesis is; none where the item is neither.
std::optional<Hypothesis> hypothesis_in(nb::handle item);

/// Farthest place of a box around a map's occupied cells from the object frame's origin.
double extent_mm(const std::vector<Hypothesis>& hypotheses);
/// Throws Error where nobody said where the object may be, and the lattice taken instead, near the
/// robot's origin, brings no object to the touch: the belief would stay as it was without a word.
void require_reach(const PoseLattice& lattice, double extent_mm, std::span<const Touch> touches);

}  // namespace palpate::python
