#pragma once

#include <cstddef>
#include <span>

#include "gpu/context.hpp"
#include "palpate/pose_histogram.hpp"

namespace palpate {

/// The memory that keeps a histogram within the device's memory and the options' limit. The plan
/// counts dense beliefs, maps, tables and the buffers of reductions; for the limit, staging memory
/// too.
struct MemoryPlan {
  std::size_t batch_elements = 0;  ///< most elements in the likelihood's tables
  bool room_to_prepare = false;    ///< for one more dense belief
};

/// Allocates nothing.
/// @throws Error where the histogram does not fit; the message says how much memory it needs
MemoryPlan plan_memory(const gpu::Context& context, std::span<const Hypothesis> hypotheses,
                       const HistogramOptions& options);

}  // namespace palpate
