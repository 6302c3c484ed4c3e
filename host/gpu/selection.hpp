#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <vulkan/vulkan_core.h>

#include "palpate/device.hpp"

namespace palpate::gpu {

/// Most buffers that one kernel binds. Vulkan guarantees 4 storage buffers and 16 texel buffers.
inline constexpr std::uint32_t max_bindings = 10;

/// A physical device, how good it is, and why it is chosen or not.
struct Candidate {
  VkPhysicalDevice physical = VK_NULL_HANDLE;
  std::uint32_t queue_family = 0;
  int rank = 0;  ///< smaller is better
  DeviceInfo info;
};

/// The device that the user wants: `name_or_index` or, if empty, PALPATE_DEVICE in the environment.
std::string wished(std::string_view name_or_index);

/// Lists every physical device of the instance and marks the best usable device as chosen: among
/// all devices, or among the devices with this index or this part of the name (case ignored).
std::vector<Candidate> candidates(VkInstance instance, std::string_view name_or_index);

std::vector<VkQueueFamilyProperties> queue_families(VkPhysicalDevice physical);

/// Why a device and its queue family cannot be used; "" where they can.
std::string fault_of(VkPhysicalDevice physical, std::uint32_t queue_family);

/// Bytes of the largest heap of device memory.
VkDeviceSize device_memory(const VkPhysicalDeviceMemoryProperties& memory);

/// Marks the candidate to open, and gives every candidate the `reason` for or against it.
void choose(std::span<Candidate> candidates, std::string_view name_or_index);

/// The chosen candidate. @throws Error naming every device and its reason if no device is chosen
const Candidate& chosen(std::span<const Candidate> candidates, std::string_view name_or_index);

}  // namespace palpate::gpu
