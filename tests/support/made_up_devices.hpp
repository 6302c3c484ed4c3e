#pragma once

#include <algorithm>
#include <ostream>

#include "support/least_limits.hpp"

namespace palpate {

/// What a device of some kind says of itself, where the kernels' sizes depend on it.
struct MadeUpDevice {
  const char* name;
  bool cpu;
  std::uint32_t subgroup;
  std::uint32_t group_invocations;
  std::uint32_t shared_kib;
  bool least = false;  ///< all that is not said here is the least that Vulkan promises

  /// These in the place of `real`'s, but no more than it has.
  gpu::Limits limits(gpu::Limits real) const {
    if (least) {
      real = gpu::least_limits(real);
    }
    real.cpu = cpu;
    real.subgroup = subgroup;
    real.group_invocations = std::min(real.group_invocations, group_invocations);
    for (std::uint32_t& size : real.group_size) {
      size = std::min(size, group_invocations);
    }
    real.shared_bytes = std::min(real.shared_bytes, shared_kib << 10);
    return real;
  }

  friend std::ostream& operator<<(std::ostream& out, const MadeUpDevice& device) {
    return out << device.name;
  }
};

inline constexpr MadeUpDevice made_up_devices[] = {
    {"CPU of 256-bit vectors", true, 8, 1024, 32}, {"CPU of 512-bit vectors", true, 16, 1024, 32},
    {"GPU of 32 lanes", false, 32, 1024, 48},      {"GPU of 64 lanes", false, 64, 1024, 64},
    {"GPU of 128 lanes", false, 128, 1024, 32},    {"small GPU", false, 4, 128, 16, true},
    {"small CPU", true, 1, 128, 16, true}};

}  // namespace palpate
