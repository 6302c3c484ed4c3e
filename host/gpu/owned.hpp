#pragma once

#include <memory>
#include <string_view>
#include <type_traits>

#include <vulkan/vulkan_core.h>

namespace palpate::gpu {

/// @param doing what was tried, for the message
/// @throws Error (Fault::system) unless the result is VK_SUCCESS
void check(VkResult result, std::string_view doing);

void destroy(VkDevice device, VkBuffer object);
void destroy(VkDevice device, VkBufferView object);
void destroy(VkDevice device, VkCommandPool object);
void destroy(VkDevice device, VkDescriptorPool object);
void destroy(VkDevice device, VkDescriptorSetLayout object);
void destroy(VkDevice device, VkDeviceMemory object);
void destroy(VkDevice device, VkFence object);
void destroy(VkDevice device, VkPipeline object);
void destroy(VkDevice device, VkPipelineLayout object);
void destroy(VkDevice device, VkQueryPool object);
void destroy(VkDevice device, VkShaderModule object);

struct Destroy {
  VkDevice device = VK_NULL_HANDLE;

  template <class Object>
  void operator()(Object* object) const {
    destroy(device, object);
  }
};

/// Owns an object of a device. Vulkan's handles are pointers on 64-bit machines.
template <class Handle>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, Destroy>;

/// Calls vkCreate... or vkAllocate... for an object.
/// @throws Error (Fault::system) where that fails; `doing` says what was tried
template <class Info, class Handle>
Owned<Handle> make_owned(VkResult (*make)(VkDevice, const Info*, const VkAllocationCallbacks*,
                                          Handle*),
                         VkDevice device, const std::type_identity_t<Info>& info,
                         std::string_view doing) {
  Handle handle = VK_NULL_HANDLE;
  check(make(device, &info, nullptr, &handle), doing);
  return {handle, {device}};
}

}  // namespace palpate::gpu
