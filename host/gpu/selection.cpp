#include "gpu/selection.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "gpu/owned.hpp"
#include "gpu/vulkan.hpp"
#include "model/number_text.hpp"
#include "palpate/error.hpp"

namespace palpate::gpu {

namespace {

/// Types of devices, the best first, and last any other.
constexpr std::pair<VkPhysicalDeviceType, const char*> types[] = {
    {VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU, "discrete"},
    {VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU, "integrated"},
    {VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU, "virtual"},
    {VK_PHYSICAL_DEVICE_TYPE_CPU, "CPU"},
    {VK_PHYSICAL_DEVICE_TYPE_OTHER, "other"}};

std::string version_text(std::uint32_t version) {
  return fmt::format("{}.{}.{}", VK_API_VERSION_MAJOR(version), VK_API_VERSION_MINOR(version),
                     VK_API_VERSION_PATCH(version));
}

std::string too_old(std::uint32_t version) {
  return fmt::format("supports Vulkan {}, 1.1 is needed", version_text(version));
}

/// A compute queue family, if possible without graphics, so that it does not wait for a desktop.
std::optional<std::uint32_t> compute_family(VkPhysicalDevice physical) {
  const std::vector<VkQueueFamilyProperties> families = queue_families(physical);
  constexpr VkQueueFlags graphics = VK_QUEUE_GRAPHICS_BIT;
  for (const VkQueueFlags unwanted : {graphics, VkQueueFlags{0}}) {
    for (std::uint32_t i = 0; i < families.size(); ++i) {
      const VkQueueFlags flags = families[i].queueFlags;
      if ((flags & VK_QUEUE_COMPUTE_BIT) != 0 && (flags & unwanted) == 0) {
        return i;
      }
    }
  }
  return {};
}

Candidate inspect(VkPhysicalDevice physical, int index) {
  VkPhysicalDeviceDriverProperties driver{.sType =
                                              VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES};
  VkPhysicalDeviceProperties2 properties2{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2};
  VkPhysicalDeviceProperties& properties = properties2.properties;
  vkGetPhysicalDeviceProperties(physical, &properties);
  const bool has_version_1_1 = properties.apiVersion >= VK_API_VERSION_1_1;
  if (properties.apiVersion >= VK_API_VERSION_1_2) {
    properties2.pNext = &driver;
    vkGetPhysicalDeviceProperties2(physical, &properties2);
  }
  VkPhysicalDeviceMemoryProperties memory;
  vkGetPhysicalDeviceMemoryProperties(physical, &memory);

  // Any other type is the last one.
  const auto* type = std::find_if(types, std::end(types) - 1, [&](const auto& candidate) {
    return candidate.first == properties.deviceType;
  });
  Candidate candidate{.physical = physical, .rank = static_cast<int>(type - types), .info = {}};
  DeviceInfo& info = candidate.info;
  info.index = index;
  info.name = properties.deviceName;
  info.type = type->second;
  info.driver = fmt::format("{} {}", driver.driverName, driver.driverInfo);
  info.api = version_text(properties.apiVersion);
  info.memory_gib = static_cast<double>(device_memory(memory)) / (1 << 30);

  const auto family = compute_family(physical);
  if (!has_version_1_1) {
    info.reason = too_old(properties.apiVersion);
  } else if (!family) {
    info.reason = "has no compute queue";
  } else {
    info.usable = true;
    candidate.queue_family = *family;
  }
  return candidate;
}

bool matches(const DeviceInfo& info, std::string_view name_or_index) {
  if (const auto index = whole_number_of(name_or_index)) {
    return info.index == *index;
  }
  return strcasestr(info.name.c_str(), std::string(name_or_index).c_str()) != nullptr;
}

}  // namespace

std::string wished(std::string_view name_or_index) {
  const char* value = std::getenv("PALPATE_DEVICE");
  return name_or_index.empty() && value != nullptr ? value : std::string(name_or_index);
}

std::vector<VkQueueFamilyProperties> queue_families(VkPhysicalDevice physical) {
  std::uint32_t count = 0;
  vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, families.data());
  return families;
}

std::string fault_of(VkPhysicalDevice physical, std::uint32_t queue_family) {
  VkPhysicalDeviceProperties properties;
  vkGetPhysicalDeviceProperties(physical, &properties);
  if (properties.apiVersion < VK_API_VERSION_1_1) {
    return fmt::format("device '{}' {}", properties.deviceName, too_old(properties.apiVersion));
  }
  const std::vector<VkQueueFamilyProperties> families = queue_families(physical);
  if (queue_family >= families.size() ||
      (families[queue_family].queueFlags & VK_QUEUE_COMPUTE_BIT) == 0) {
    return fmt::format("queue_family = {}: device '{}' has no such family that computes",
                       queue_family, properties.deviceName);
  }
  return {};
}

VkDeviceSize device_memory(const VkPhysicalDeviceMemoryProperties& memory) {
  VkDeviceSize bytes = 0;
  for (std::uint32_t i = 0; i < memory.memoryHeapCount; ++i) {
    if ((memory.memoryHeaps[i].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT) != 0) {
      bytes = std::max(bytes, memory.memoryHeaps[i].size);
    }
  }
  return bytes;
}

void choose(std::span<Candidate> candidates, std::string_view name_or_index) {
  Candidate* best = nullptr;
  for (Candidate& candidate : candidates) {
    if (!candidate.info.usable) {
      continue;
    }
    if (!name_or_index.empty() && !matches(candidate.info, name_or_index)) {
      candidate.info.reason = fmt::format("does not match '{}'", name_or_index);
    } else if (best == nullptr || candidate.rank < best->rank) {
      best = &candidate;
    }
  }
  if (best == nullptr) {
    return;
  }
  for (Candidate& candidate : candidates) {
    if (&candidate != best && candidate.info.reason.empty()) {
      candidate.info.reason =
          candidate.rank == best->rank
              ? fmt::format("as good as device {}, which comes first", best->info.index)
              : fmt::format("ranks behind device {} (discrete, integrated, virtual, CPU)",
                            best->info.index);
    }
  }
  best->info.chosen = true;
  best->info.reason = name_or_index.empty()
                          ? "the best usable device"
                          : fmt::format("the best device that matches '{}'", name_or_index);
}

std::vector<Candidate> candidates(VkInstance instance, std::string_view name_or_index) {
  std::uint32_t count = 0;
  check(vkEnumeratePhysicalDevices(instance, &count, nullptr), "listing the Vulkan devices");
  std::vector<VkPhysicalDevice> devices(count);
  check(vkEnumeratePhysicalDevices(instance, &count, devices.data()), "listing the Vulkan devices");
  std::vector<Candidate> result;
  for (std::uint32_t i = 0; i < count; ++i) {
    result.push_back(inspect(devices[i], static_cast<int>(i)));
  }
  choose(result, name_or_index);
  return result;
}

const Candidate& chosen(std::span<const Candidate> candidates, std::string_view name_or_index) {
  const auto found =
      std::ranges::find_if(candidates, [](const Candidate& c) { return c.info.chosen; });
  if (found != candidates.end()) {
    return *found;
  }
  if (candidates.empty()) {
    throw Error(Fault::system,
                "no Vulkan device; on Debian, install libvulkan1 and mesa-vulkan-drivers, and see "
                "'palpate devices'");
  }
  std::string reasons;
  for (const Candidate& candidate : candidates) {
    reasons += fmt::format("{}{} '{}' {}", reasons.empty() ? "" : "; ", candidate.info.index,
                           candidate.info.name, candidate.info.reason);
  }
  // A name that no device matches is the user's fault, a machine without usable device is not.
  if (name_or_index.empty()) {
    throw Error(Fault::system, fmt::format("no usable Vulkan device: {}", reasons));
  }
  throw Error(Fault::input, fmt::format("device '{}': none fits: {}; see 'palpate devices'",
                                        name_or_index, reasons));
}

}  // namespace palpate::gpu
