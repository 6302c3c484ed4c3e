#include "gpu/context.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <utility>

#include <fmt/format.h>

#include "gpu/owned.hpp"
#include "gpu/selection.hpp"
#include "gpu/vulkan.hpp"
#include "model/log_message.hpp"
#include "palpate/error.hpp"

namespace palpate::gpu {

namespace {

VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT /*severity*/,
                                          VkDebugUtilsMessageTypeFlagsEXT /*types*/,
                                          const VkDebugUtilsMessengerCallbackDataEXT* data,
                                          void* log) {
  static_cast<ValidationLog*>(log)->add(data->pMessage);
  return VK_FALSE;
}

bool validation_wanted() {
  const char* value = std::getenv("PALPATE_VALIDATION");
  return value != nullptr && std::strcmp(value, "1") == 0;
}

struct VulkanUses {
  std::mutex mutex;
  int count = 0;
  OwnProcess process;  ///< the process that uses Vulkan, where one does
};

VulkanUses& vulkan_uses() {
  static VulkanUses uses;
  return uses;
}

template <typename Function>
Function instance_function(VkInstance instance, const char* name) {
  return reinterpret_cast<Function>(vkGetInstanceProcAddr(instance, name));
}

}  // namespace

void ValidationLog::add(std::string message) {
  const std::scoped_lock lock(mutex_);
  if (first_.empty()) {
    first_ = std::move(message);
  }
}

void ValidationLog::throw_if_any() {
  const std::scoped_lock lock(mutex_);
  if (!first_.empty()) {
    throw Error(Fault::system, "Vulkan validation: " + std::exchange(first_, {}));
  }
}

VulkanUse::VulkanUse() {
  VulkanUses& uses = vulkan_uses();
  const std::scoped_lock lock(uses.mutex);
  if (uses.count > 0) {
    uses.process.require("Vulkan");
  } else {
    uses.process = OwnProcess();
  }
  load_vulkan();
  ++uses.count;
}

VulkanUse::~VulkanUse() {
  VulkanUses& uses = vulkan_uses();
  const std::scoped_lock lock(uses.mutex);
  --uses.count;
}

Instance::Instance() {
  const VkApplicationInfo application{.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO,
                                      .pApplicationName = "palpate",
                                      .apiVersion = VK_API_VERSION_1_2};
  const VkDebugUtilsMessengerCreateInfoEXT messenger_info{
      .sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT,
      .messageSeverity = VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT |
                         VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT,
      .messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT |
                     VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT,
      .pfnUserCallback = on_message,
      .pUserData = &validation_};
  const char* layer = "VK_LAYER_KHRONOS_validation";
  const char* extension = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
  VkInstanceCreateInfo info{.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO,
                            .pApplicationInfo = &application};
  if (validation_wanted()) {
    info.pNext = &messenger_info;
    info.enabledLayerCount = 1;
    info.ppEnabledLayerNames = &layer;
    info.enabledExtensionCount = 1;
    info.ppEnabledExtensionNames = &extension;
  }
  check(create_instance(info, instance_), "starting Vulkan");
  if (validation_wanted()) {
    const auto create = instance_function<PFN_vkCreateDebugUtilsMessengerEXT>(
        instance_, "vkCreateDebugUtilsMessengerEXT");
    const VkResult result = create(instance_, &messenger_info, nullptr, &messenger_);
    if (result != VK_SUCCESS) {
      vkDestroyInstance(instance_, nullptr);
      check(result, "starting Vulkan validation");
    }
  }
}

Instance::~Instance() {
  if (messenger_ != VK_NULL_HANDLE) {
    instance_function<PFN_vkDestroyDebugUtilsMessengerEXT>(
        instance_, "vkDestroyDebugUtilsMessengerEXT")(instance_, messenger_, nullptr);
  }
  vkDestroyInstance(instance_, nullptr);
  // A destructor cannot throw, yet a message about a leaked or misused object must not get lost:
  // std::terminate() ends the program with it.
  try {
    validation_.throw_if_any();
  } catch (const Error& error) {
    log_message(LogLevel::error, error.what());
    std::terminate();
  }
}

Context::Context(std::string_view name_or_index) : instance_(std::in_place) {
  const std::string wish = wished(name_or_index);
  const std::vector<Candidate> all = candidates(instance_->handle(), wish);
  const Candidate& candidate = chosen(all, wish);
  physical_ = candidate.physical;
  queue_family_ = candidate.queue_family;
  inspect();

  const float priority = 1.0F;
  const VkDeviceQueueCreateInfo queue_info{.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO,
                                           .queueFamilyIndex = queue_family_,
                                           .queueCount = 1,
                                           .pQueuePriorities = &priority};
  const VkDeviceCreateInfo info{.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
                                .queueCreateInfoCount = 1,
                                .pQueueCreateInfos = &queue_info};
  check(vkCreateDevice(physical_, &info, nullptr, &device_),
        fmt::format("opening device '{}'", name_));
  vkGetDeviceQueue(device_, queue_family_, 0, &queue_);
  log_message(LogLevel::info, fmt::format("device '{}': {}", name_, candidate.info.reason));
}

Context::Context(const VulkanDevice& handed_in)
    : physical_(handed_in.physical_device),
      device_(handed_in.device),
      queue_(handed_in.queue),
      queue_family_(handed_in.queue_family) {
  if (handed_in.instance == VK_NULL_HANDLE || physical_ == VK_NULL_HANDLE ||
      device_ == VK_NULL_HANDLE || queue_ == VK_NULL_HANDLE) {
    throw Error(Fault::input,
                "VulkanDevice: a handle is null; give instance, physical_device, device and queue");
  }
  if (handed_in.queue_mutex != nullptr) {
    queue_mutex_ = handed_in.queue_mutex;
  }
  const std::string fault = fault_of(physical_, queue_family_);
  if (!fault.empty()) {
    throw Error(Fault::input, fmt::format("VulkanDevice: {}", fault));
  }
  inspect();
  log_message(LogLevel::info, fmt::format("device '{}': handed in by the program", name_));
}

void Context::inspect() {
  VkPhysicalDeviceSubgroupProperties subgroup{
      .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_PROPERTIES};
  VkPhysicalDeviceMaintenance3Properties maintenance{
      .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_3_PROPERTIES, .pNext = &subgroup};
  VkPhysicalDeviceProperties2 properties{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2,
                                         .pNext = &maintenance};
  vkGetPhysicalDeviceProperties2(physical_, &properties);
  name_ = properties.properties.deviceName;
  const VkPhysicalDeviceLimits& limits = properties.properties.limits;
  limits_.group_invocations = limits.maxComputeWorkGroupInvocations;
  std::copy_n(limits.maxComputeWorkGroupSize, 3, limits_.group_size);
  limits_.shared_bytes = limits.maxComputeSharedMemorySize;
  limits_.subgroup = subgroup.subgroupSize;
  limits_.storage_range = limits.maxStorageBufferRange;
  limits_.allocation = maintenance.maxMemoryAllocationSize;
  limits_.table_texels = limits.maxTexelBufferElements;
  limits_.cpu = properties.properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
  std::copy_n(limits.maxComputeWorkGroupCount, 3, limits_.group_count);
  limits_.push_bytes = limits.maxPushConstantsSize;

  const std::uint32_t timestamp_bits = queue_families(physical_)[queue_family_].timestampValidBits;
  if (timestamp_bits > 0) {
    limits_.timestamp_ns = limits.timestampPeriod;
    limits_.timestamp_mask = ~std::uint64_t{0} >> (64 - timestamp_bits);
  }
  vkGetPhysicalDeviceMemoryProperties(physical_, &memory_);
  limits_.memory = device_memory(memory_);
}

Context::~Context() {
  // Every command stream has waited for its own commands; the program's are not ours to wait for.
  pipelines_.clear();
  if (instance_ && device_ != VK_NULL_HANDLE) {
    vkDestroyDevice(device_, nullptr);
  }
}

VkResult Context::submit(const VkSubmitInfo& info, VkFence fence) {
  const std::scoped_lock lock(*queue_mutex_);
  return vkQueueSubmit(queue_, 1, &info, fence);
}

MemoryUse Context::memory_use() const {
  const std::scoped_lock lock(memory_use_mutex_);
  return memory_use_;
}

void Context::take_memory(VkDeviceSize bytes) {
  const std::scoped_lock lock(memory_use_mutex_);
  memory_use_.now += bytes;
  memory_use_.peak = std::max(memory_use_.peak, memory_use_.now);
}

void Context::give_memory(VkDeviceSize bytes) {
  const std::scoped_lock lock(memory_use_mutex_);
  memory_use_.now -= bytes;
}

std::uint32_t Context::memory_type(std::uint32_t type_bits, VkMemoryPropertyFlags flags,
                                   VkMemoryPropertyFlags preferred) const {
  for (const VkMemoryPropertyFlags wanted : {flags | preferred, flags}) {
    for (std::uint32_t i = 0; i < memory_.memoryTypeCount; ++i) {
      if ((type_bits & (1U << i)) != 0 &&
          (memory_.memoryTypes[i].propertyFlags & wanted) == wanted) {
        return i;
      }
    }
  }
  throw Error(Fault::system,
              fmt::format("device '{}': has no memory with the properties {:#x}", name_, flags));
}

}  // namespace palpate::gpu

namespace palpate {

std::vector<DeviceInfo> Device::list(std::string_view name_or_index) {
  gpu::Instance instance;
  std::vector<DeviceInfo> infos;
  for (gpu::Candidate& candidate : gpu::candidates(instance.handle(), gpu::wished(name_or_index))) {
    infos.push_back(std::move(candidate.info));
  }
  return infos;
}

Device Device::open(std::string_view name_or_index) {
  return Device(new gpu::Context(name_or_index));
}

Device Device::share(const VulkanDevice& device) { return Device(new gpu::Context(device)); }

Device::Device(gpu::Context* context) : context_(context, delete_here<gpu::Context>) {}

const std::string& Device::name() const { return held_by(context_, "device").name(); }
std::uint64_t Device::memory_bytes() const { return held_by(context_, "device").limits().memory; }
gpu::Context& Device::context() { return held_here(context_, "device"); }

}  // namespace palpate
