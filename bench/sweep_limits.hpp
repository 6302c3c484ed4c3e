#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sweep_plan.hpp"
#include "sweep_point.hpp"

namespace palpate::bench {

/// Pose errors of all trials on one lattice where one thing about the sensor, its touches or the
/// maps is otherwise, from windows: of how well the object and its neighbourhood are found they say
/// nothing.
struct Limit {
  std::string name;
  std::int64_t count = 0;    ///< bins per object
  std::size_t elements = 0;  ///< of the array
  std::vector<TrialErrors> errors;
  std::optional<std::size_t> against = {};  ///< the limit it is compared with
};

struct LimitPlan {
  std::vector<BinCounts> lattices;  ///< the first for every variant, all for arrays
  int trials_each = 0;
  int touches = 0;
  std::uint64_t seed = 0;  ///< of the trials
  bool quick = false;      ///< two of the variants
};

/// Where the errors that no bin mends come from: the variants one by one, each against the first,
/// which is as everywhere else; the arrays, that one's included, on all lattices, each against its
/// first.
std::vector<Limit> measure_limits(Device& device, const LimitPlan& plan);

}  // namespace palpate::bench
