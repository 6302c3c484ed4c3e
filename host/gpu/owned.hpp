#pragma once

#include <memory>
#include <string_view>
#include <type_traits>

#include "result.hpp"

namespace palpate::gpu {

template <auto destroy>
struct Destroy {
  VkDevice device = VK_NULL_HANDLE;

  template <class Object>
  void operator()(Object* object) const {
    destroy(device, object, nullptr);
  }
};

/// Owns an object of a device. Vulkan's handles are pointers on 64-bit machines.
template <class Handle, auto destroy>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, Destroy<destroy>>;

/// Calls vkCreate... or vkAllocate... for an object that `destroy` gives back.
/// @throws Error (Fault::system) where that fails; `doing` says what was tried
template <auto destroy, class Info, class Handle>
Owned<Handle, destroy> make_owned(VkResult (*make)(VkDevice, const Info*,
                                                   const VkAllocationCallbacks*, Handle*),
                                  VkDevice device, const std::type_identity_t<Info>& info,
                                  std::string_view doing) {
  Handle handle = VK_NULL_HANDLE;
  check(make(device, &info, nullptr, &handle), doing);
  return {handle, {device}};
}

}  // namespace palpate::gpu
