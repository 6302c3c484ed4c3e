#pragma once

#include <string_view>

#include <vulkan/vulkan.h>

namespace palpate::gpu {

/// Throws Error (Fault::system) unless the result is VK_SUCCESS; `doing` says what was tried.
void check(VkResult result, std::string_view doing);

}  // namespace palpate::gpu
