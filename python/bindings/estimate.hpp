#pragma once

#include <optional>
#include <vector>

#include "arrays.hpp"
#include "palpate/estimate.hpp"
#include "palpate/plan.hpp"

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

}  // namespace palpate::python
