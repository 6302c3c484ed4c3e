#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <vulkan/vulkan.h>

#include "palpate/device.hpp"

namespace palpate::gpu {

/// Most buffers that one kernel binds. Every device takes 4 storage buffers and 16 tables.
inline constexpr std::uint32_t max_bindings = 7;

/// A physical device with what speaks for or against it.
struct Candidate {
  VkPhysicalDevice physical = VK_NULL_HANDLE;
  std::uint32_t queue_family = 0;
  int rank = 0;  ///< smaller is better
  DeviceInfo info;
};

/// The wish, or where there is none, that of PALPATE_DEVICE in the environment.
std::string wished(std::string_view name_or_index);

/// Every physical device of the instance. One of the usable ones is marked as chosen, if any fits
/// the wish: an index, a part of a name (case ignored), or nothing for the best.
std::vector<Candidate> candidates(VkInstance instance, std::string_view name_or_index);

/// Bytes of the largest heap of device memory.
VkDeviceSize device_memory(const VkPhysicalDeviceMemoryProperties& memory);

/// Marks the one to open and says in `reason` why it, or why not.
void choose(std::span<Candidate> candidates, std::string_view name_or_index);

/// The chosen candidate. Throws Error naming every device and its reason when there is none.
const Candidate& chosen(std::span<const Candidate> candidates, std::string_view name_or_index);

}  // namespace palpate::gpu
