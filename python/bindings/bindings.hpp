#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "palpate/touch.hpp"
#include "types.hpp"

namespace palpate::python {

// Each function adds a part of the module; later ones use the types of earlier ones.
void bind_model(nb::module_& module);
void bind_maps(nb::module_& module);
void bind_touches(nb::module_& module);
void bind_map_builder(nb::module_& module);
void bind_estimate(nb::module_& module);
void bind_filters(nb::module_& module);
void bind_simulation(nb::module_& module);
void bind_sensors(nb::module_& module);
void bind_request(nb::module_& module);
void bind_recognition(nb::module_& module);
void bind_batch(nb::module_& module);
void bind_learning(nb::module_& module);
void bind_import(nb::module_& module);

/// "PoseLattice(x_mm=(-10, 10, 25), ...)"
std::string text_of(const PoseLattice& lattice);
/// "x 1.00 mm, y 2.00 mm, theta 0.500 rad"
std::string text_of(const Pose& pose);

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
