#pragma once

#include <cstddef>
#include <span>

#include "context.hpp"
#include "palpate/pose_histogram.hpp"

namespace palpate {

/// What a histogram may take so that it stays within the device's memory and within the limit that
/// the options set: beliefs, maps, tables, what reductions take while they run, and for the limit
/// also the staging memory.
struct MemoryPlan {
  std::size_t batch_elements = 0;  ///< most that the likelihood's tables may hold
  bool room_to_prepare = false;    ///< for one more belief beside all of it
};

/// Nothing is allocated.
/// @throws Error where the histogram does not fit, with what it needs
MemoryPlan plan_memory(const gpu::Context& context, std::span<const Hypothesis> hypotheses,
                       const HistogramOptions& options);

}  // namespace palpate
