#include "gpu/owned.hpp"

#include <string>

#include <fmt/format.h>

#include "gpu/vulkan.hpp"
#include "palpate/error.hpp"

namespace palpate::gpu {

namespace {

std::string meaning(VkResult result) {
  switch (result) {
    case VK_ERROR_DEVICE_LOST:
      return "the device was lost (a driver reset, or a command that ran too long); start again, "
             "and if it happens again use fewer bins or another `device`";
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
      return "out of device memory; use fewer bins, objects or cells";
    case VK_ERROR_OUT_OF_HOST_MEMORY:
      return "out of host memory; use fewer bins, objects or cells";
    case VK_ERROR_INITIALIZATION_FAILED:
      return "the driver could not be initialised";
    case VK_ERROR_INCOMPATIBLE_DRIVER:
      return "no Vulkan driver was found; on Debian, install libvulkan1 and mesa-vulkan-drivers";
    case VK_ERROR_LAYER_NOT_PRESENT:
      return "the validation layer is missing; install vulkan-validationlayers or unset "
             "PALPATE_VALIDATION";
    default:
      return fmt::format("VkResult {}", static_cast<int>(result));
  }
}

}  // namespace

void check(VkResult result, std::string_view doing) {
  if (result != VK_SUCCESS) {
    throw Error(Fault::system, fmt::format("{}: {}", doing, meaning(result)));
  }
}

}  // namespace palpate::gpu
