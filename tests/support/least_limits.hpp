#pragma once

#include <algorithm>
#include <iterator>

#include "gpu/context.hpp"

namespace palpate::gpu {

/// A device's limits, each replaced by the least that Vulkan 1.1 promises (its table "Required
/// Limits").
inline Limits least_limits(Limits limits) {
  limits.group_invocations = 128;
  limits.group_size[0] = limits.group_size[1] = 128;
  limits.group_size[2] = 64;
  std::fill(std::begin(limits.group_count), std::end(limits.group_count), 65'535U);
  limits.shared_bytes = 16 << 10;
  limits.subgroup = 1;
  limits.storage_range = 128 << 20;
  limits.allocation = 1 << 30;
  limits.table_texels = 65'536;
  limits.push_bytes = 128;
  return limits;
}

}  // namespace palpate::gpu
