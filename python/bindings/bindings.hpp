#pragma once

#include "palpate/lattice.hpp"
#include "types.hpp"

namespace palpate::python {

// Each function adds a part of the module; later ones use the types of earlier ones.
void bind_model(nb::module_& module);
void bind_maps(nb::module_& module);
void bind_touches(nb::module_& module);
void bind_device(nb::module_& module);
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

}  // namespace palpate::python
