#pragma once

#include <string_view>

#include <vulkan/vulkan_core.h>

namespace palpate::gpu {

/// @param doing what was tried, for the message
/// @throws Error (Fault::system) unless the result is VK_SUCCESS
void check(VkResult result, std::string_view doing);

}  // namespace palpate::gpu
