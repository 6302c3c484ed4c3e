#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sweep_point.hpp"

namespace palpate::bench {

/// One way to evaluate the likelihood: its time and its deviation from float64.
struct Precision {
  std::string path;
  std::int64_t count = 0;    ///< bins per object
  double nanoseconds = 0.0;  ///< per pose, element and touch
  Deviation deviation;
};

/// The likelihood alone, without reductions, on one lattice by the engine's ways and the two
/// baselines side by side. The engine's are the product of Eq. 7, the same in logs (gamma = 0), and
/// an array at rest; the baselines the one-bin kernel and the loop on the host's cores.
/// @throws Error unless a touch of the unknown has half its elements or more in No Contact, which
/// is what makes an array at rest worth while
std::vector<Precision> compare_paths(Device& device, std::span<const Hypothesis> letters,
                                     const Recording& unknown, const PoseLattice& lattice);

}  // namespace palpate::bench
