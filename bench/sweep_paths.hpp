#pragma once

#include "palpate/lattice.hpp"
#include "table.hpp"
#include "trials.hpp"

namespace palpate::bench {

/// Times the likelihood alone, without reductions, on one lattice, and its deviation from float64.
/// Returns a record of each way to evaluate it: the product of Eq. 7, the same in logs (gamma = 0),
/// an array at rest, the one-bin kernel, and the loop on the host's cores. The ways take turns.
/// @throws Error unless some touch of the unknown has at least half its elements in No Contact,
/// which an array at rest needs to gain anything
Json compare_paths(Device& device, std::span<const Hypothesis> letters, const Recording& unknown,
                   const PoseLattice& lattice);

}  // namespace palpate::bench
