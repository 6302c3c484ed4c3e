#pragma once

#include "types.hpp"

namespace palpate::python {

// Each function adds a part of the module; later ones use the types of earlier ones.
void bind_model(nb::module_& module);
void bind_maps(nb::module_& module);
void bind_touches(nb::module_& module);
void bind_device(nb::module_& module);
void bind_map_builder(nb::module_& module);
void bind_estimate(nb::module_& module);
void bind_pose_histogram(nb::module_& module);
void bind_bounded_posterior(nb::module_& module);
void bind_particle_filter(nb::module_& module);
void bind_simulation(nb::module_& module);
void bind_sensors(nb::module_& module);
void bind_request(nb::module_& module);
void bind_recognition(nb::module_& module);
void bind_batch(nb::module_& module);
void bind_plan(nb::module_& module);
void bind_evaluation(nb::module_& module);
void bind_calibration(nb::module_& module);
void bind_import(nb::module_& module);

}  // namespace palpate::python
