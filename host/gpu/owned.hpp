#pragma once

#include <memory>
#include <string_view>
#include <type_traits>

#include <vulkan/vulkan_core.h>

namespace palpate::gpu {

/// @param doing what was tried, for the message
/// @throws Error (Fault::system) unless the result is VK_SUCCESS
void check(VkResult result, std::string_view doing);

/// A function such as vkDestroyBuffer or vkFreeMemory.
template <class Handle>
using Destroy = void (*)(VkDevice, Handle, const VkAllocationCallbacks*);

template <class Handle>
struct DestroyObject {
  VkDevice device = VK_NULL_HANDLE;
  Destroy<Handle> destroy = nullptr;

  void operator()(Handle object) const { destroy(device, object, nullptr); }
};

/// Owns an object of a device. Vulkan's handles are pointers on 64-bit machines.
template <class Handle>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, DestroyObject<Handle>>;

/// Calls vkCreate... or vkAllocate... for an object that `destroy` ends.
/// @throws Error (Fault::system) where that fails; `doing` says what was tried
template <class Info, class Handle>
Owned<Handle> make_owned(VkResult (*make)(VkDevice, const Info*, const VkAllocationCallbacks*,
                                          Handle*),
                         std::type_identity_t<Destroy<Handle>> destroy, VkDevice device,
                         const std::type_identity_t<Info>& info, std::string_view doing) {
  Handle handle = VK_NULL_HANDLE;
  check(make(device, &info, nullptr, &handle), doing);
  return {handle, {device, destroy}};
}

}  // namespace palpate::gpu
