#define VOLK_IMPLEMENTATION
#include "gpu/vulkan.hpp"

#include <cstdlib>
#include <mutex>
#include <set>
#include <string>

#include <dlfcn.h>
#include <fmt/format.h>
#include <link.h>

#include "gpu/owned.hpp"
#include "palpate/error.hpp"

namespace palpate::gpu {

namespace {

void* library = nullptr;  ///< stays loaded until the process ends: its functions are everywhere

PFN_vkVoidFunction exported_function(VkInstance /*instance*/, const char* name) {
  return reinterpret_cast<PFN_vkVoidFunction>(dlsym(library, name));
}

/// The files of the libraries that the process has loaded.
std::set<std::string> loaded_libraries() {
  std::set<std::string> files;
  dl_iterate_phdr(
      [](dl_phdr_info* info, std::size_t /*size*/, void* to) {
        static_cast<std::set<std::string>*>(to)->insert(info->dlpi_name);
        return 0;
      },
      &files);
  return files;
}

[[noreturn]] void refuse(std::string_view why) {
  throw Error(Fault::system,
              fmt::format("Vulkan cannot be loaded: {}; on Debian, install libvulkan1 "
                          "and mesa-vulkan-drivers",
                          why));
}

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

// The pointers are the functions that the loader exports, which a program that links the loader
// calls, too. Each finds its instance or device by the handle that it is given. One set of pointers
// therefore fits every device of the process, also one that the program hands in, and devices with
// and without the validation layer; they are set once, before any use. What vkGetInstanceProcAddr()
// returns is promised for one instance only, and volkLoadDevice() sets the same pointers to the
// functions of one device. A table for each device (volkLoadDeviceTable()) would save a jump in
// each call, which is nothing beside a dispatch.
void load_vulkan() {
  static std::mutex mutex;
  const std::scoped_lock lock(mutex);
  if (library != nullptr) {
    return;
  }
  const char* name = std::getenv("PALPATE_VULKAN_LIBRARY");
  if (name == nullptr || *name == '\0') {
    name = "libvulkan.so.1";
  }
  void* opened = dlopen(name, RTLD_NOW | RTLD_LOCAL);
  if (opened == nullptr) {
    refuse(dlerror());
  }
  // vkGetPhysicalDeviceProperties2 came with Vulkan 1.1.
  const auto of_instance =
      reinterpret_cast<PFN_vkGetInstanceProcAddr>(dlsym(opened, "vkGetInstanceProcAddr"));
  if (of_instance == nullptr || dlsym(opened, "vkGetPhysicalDeviceProperties2") == nullptr) {
    dlclose(opened);
    refuse(fmt::format("{} is no loader of Vulkan 1.1", name));
  }
  library = opened;
  volkInitializeCustom(exported_function);
  volkLoadInstance(VK_NULL_HANDLE);
  vkGetInstanceProcAddr = of_instance;  // finds the functions of extensions
}

VkResult create_instance(const VkInstanceCreateInfo& info, VkInstance& instance) {
  const std::set<std::string> before = loaded_libraries();
  const VkResult result = vkCreateInstance(&info, nullptr, &instance);
  for (const std::string& file : loaded_libraries()) {
    if (!before.contains(file)) {
      if (void* again = dlopen(file.c_str(), RTLD_LAZY | RTLD_NOLOAD | RTLD_NODELETE)) {
        dlclose(again);
      }
    }
  }
  return result;
}

}  // namespace palpate::gpu
