#pragma once

#include <cstddef>
#include <span>

#include "context.hpp"
#include "palpate/pose_histogram.hpp"

namespace palpate {

/// Most elements that the likelihood's tables may hold so that a histogram stays within the
/// device's memory and within the limit that the options set: beliefs, maps, tables, what
/// reductions take while they run, and for the limit also the staging memory. Nothing is allocated.
/// @throws Error where it does not fit, with what it needs
std::size_t plan_memory(const gpu::Context& context, std::span<const Hypothesis> hypotheses,
                        const HistogramOptions& options);

}  // namespace palpate
