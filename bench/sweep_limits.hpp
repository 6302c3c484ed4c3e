#pragma once

#include <cstdint>
#include <vector>

#include "palpate/device.hpp"
#include "sweep_plan.hpp"
#include "table.hpp"

namespace palpate::bench {

struct LimitPlan {
  std::vector<BinCounts> lattices;  ///< the first for every variant, all for arrays
  int trials_each = 0;              ///< per letter
  int touches = 0;
  std::uint64_t seed = 0;  ///< of the trials
  bool quick = false;      ///< two of the variants
};

/// Where the errors come from that more bins do not mend: changes one thing about the sensor, its
/// touches or the maps at a time and returns a record of each variant on each lattice, with pose
/// errors from windows (estimate_in_window()). Every variant is compared with the first, which
/// changes nothing; arrays, its own included, also run on the other lattices, each compared with
/// the same array on the first lattice.
Json measure_limits(Device& device, const LimitPlan& plan);

}  // namespace palpate::bench
