#pragma once

#include "palpate/device.hpp"
#include "sweep_plan.hpp"
#include "table.hpp"

namespace palpate::bench {

/// Where the errors come from that more bins do not mend: changes one thing about the sensor, its
/// touches or the maps at a time and returns a record of each variant on each lattice, with pose
/// errors from windows (estimate_in_window()). Every variant is compared with the first, which
/// changes nothing, on the first of plan.limits; arrays, its own included, also run on the other
/// lattices, each compared with the same array on the first.
Json measure_limits(Device& device, const SweepPlan& plan);

}  // namespace palpate::bench
