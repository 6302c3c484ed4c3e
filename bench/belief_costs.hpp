#pragma once

#include <vector>

#include "palpate/pose_histogram.hpp"
#include "report.hpp"

namespace palpate::bench {

/// Times a touch with HistogramOptions::touch_sd, slip_sd and none_weight beside a plain touch, in
/// turn on the same lattice, and compares the device memory.
Case touch_cost_case(Device& device, const std::vector<Hypothesis>& letters,
                     const PoseLattice& lattice, int repeats);

/// Times a touch with touch_sd from the touch to the estimate, on a small lattice.
Case latency_of_averaged_case(Device& device, const std::vector<Hypothesis>& letters, int repeats);

/// Times PoseHistogram::expected_gain() over 200 candidates, after three touches.
Case plan_cost_case(Device& device, const std::vector<Hypothesis>& letters, int repeats);

/// The device memory of a lattice of 5 x 10,000,000 bins with touch_sd, and a touch on it.
Case large_belief_case(Device& device, const std::vector<Hypothesis>& letters);

}  // namespace palpate::bench
