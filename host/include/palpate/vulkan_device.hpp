#pragma once

// For programs that use Vulkan themselves. No other header of Palpate needs Vulkan's.

#include <cstdint>
#include <mutex>

#include <vulkan/vulkan_core.h>

namespace palpate {

/// A program's own Vulkan device, for Device::share(). Needs Vulkan 1.1 of the instance and of the
/// device, but no feature and no extension.
struct VulkanDevice {
  VkInstance instance = VK_NULL_HANDLE;
  VkPhysicalDevice physical_device = VK_NULL_HANDLE;
  VkDevice device = VK_NULL_HANDLE;
  std::uint32_t queue_family = 0;  ///< index of a family that computes
  VkQueue queue = VK_NULL_HANDLE;  ///< of that family
  /// Locked while Palpate submits to the queue. Give the mutex that the program locks for its own
  /// calls of vkQueueSubmit() and the like; null where the program leaves the queue to Palpate.
  std::mutex* queue_mutex = nullptr;
};

}  // namespace palpate
