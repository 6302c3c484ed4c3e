#pragma once

#include <cstddef>

#include "gpu/context.hpp"
#include "palpate/pose_histogram.hpp"

namespace palpate {

/// Throws Error where the device holds fewer bins, before there is a buffer of them.
void require_room(const gpu::Context& context, const HistogramOptions& options,
                  std::size_t objects);

}  // namespace palpate
