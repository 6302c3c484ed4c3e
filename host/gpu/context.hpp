#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include <vulkan/vulkan_core.h>

#include "gpu/kernel.hpp"
#include "model/own_process.hpp"
#include "palpate/device.hpp"
#include "palpate/vulkan_device.hpp"

namespace palpate::gpu {

/// Keeps the first message of Vulkan's validation layer.
class ValidationLog {
 public:
  void add(std::string message);
  /// @throws Error with the message, if there is any
  void throw_if_any();

 private:
  std::mutex mutex_;
  std::string first_;
};

/// Counts as a use of Vulkan while it lives. Drivers keep threads, for which even the end of a
/// child of fork() would wait once it has started others: where the parent used Vulkan at the fork,
/// its child cannot.
class VulkanUse {
 public:
  /// @throws Error in such a child, and where Vulkan is missing
  VulkanUse();
  ~VulkanUse();
  VulkanUse(const VulkanUse&) = delete;
  VulkanUse& operator=(const VulkanUse&) = delete;
};

/// A Vulkan instance. PALPATE_VALIDATION=1 in the environment turns the validation layer on.
class Instance {
 public:
  Instance();
  ~Instance();
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;

  VkInstance handle() const { return instance_; }
  ValidationLog& validation() { return validation_; }

 private:
  VulkanUse use_;
  VkInstance instance_ = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
  ValidationLog validation_;
};

/// Most iterations of all loops in one invocation of a kernel. The driver lavapipe silently ends
/// loops after 65,535 iterations; half of this number leaves room for outer loops.
inline constexpr std::uint32_t most_iterations = 1 << 15;

/// Limits of the device for the sizes of buffers, workgroups and dispatches.
struct Limits {
  std::uint32_t group_invocations = 0;  ///< invocations of one workgroup
  std::uint32_t group_size[3] = {};     ///< invocations of one workgroup along each dimension
  std::uint32_t shared_bytes = 0;       ///< shared memory of one workgroup, in bytes
  std::uint32_t subgroup = 0;           ///< invocations that run in lockstep
  VkDeviceSize storage_range = 0;       ///< size of one storage-buffer binding, in bytes
  VkDeviceSize allocation = 0;          ///< size of one allocation, in bytes
  std::uint32_t table_texels = 0;       ///< texels of one texel buffer
  bool cpu = false;                     ///< the device is a CPU, whose cores a few workgroups fill
  VkDeviceSize memory = 0;              ///< size of the largest heap of device memory, in bytes
  std::uint32_t group_count[3] = {};    ///< workgroups of one dispatch along each dimension
  std::uint32_t push_bytes = 0;         ///< size of the push constants, in bytes
  std::uint64_t timestamp_mask = 0;     ///< the valid bits of a timestamp
  float timestamp_ns = 0.0F;            ///< ns per tick; 0 if the queue has no timestamps
};

/// Memory of all buffers of a device, staging included, in bytes.
struct MemoryUse {
  VkDeviceSize now = 0;
  VkDeviceSize peak = 0;
};

/// A logical device with one compute queue, opened as Device::open() says, or the program's own.
/// Several threads may use it at the same time, but for lower_limits().
class Context {
 public:
  explicit Context(std::string_view name_or_index);
  /// @throws Error as Device::share() says
  explicit Context(const VulkanDevice& handed_in);
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  const OwnProcess process;

  VkDevice device() const { return device_; }
  /// Submits to the queue; the commands of several threads take turns.
  VkResult submit(const VkSubmitInfo& info, VkFence fence);
  /// What kernels share.
  Pipelines& pipelines() { return pipelines_; }
  std::uint32_t queue_family() const { return queue_family_; }
  const std::string& name() const { return name_; }
  const Limits& limits() const { return limits_; }
  /// Stays empty on a device that was handed in: the program gets the messages of its instance.
  ValidationLog& validation() { return instance_ ? instance_->validation() : no_messages_; }
  /// Puts lower ones in the place of the device's own limits. Only tests do so: on any device they
  /// reach the cases of much smaller devices and much larger problems.
  void lower_limits(const Limits& limits) { limits_ = limits; }

  /// What buffers take, and took at most.
  MemoryUse memory_use() const;
  /// Counts memory; buffers call this pair when they allocate memory and when they free it.
  void take_memory(VkDeviceSize bytes);
  void give_memory(VkDeviceSize bytes);

  /// The first memory type in `type_bits` that has all of `flags`, and if possible all of
  /// `preferred`. @throws Error if no type has all of `flags`
  std::uint32_t memory_type(std::uint32_t type_bits, VkMemoryPropertyFlags flags,
                            VkMemoryPropertyFlags preferred) const;

 private:
  /// Reads what `physical_` and its queue family can do.
  void inspect();

  VulkanUse use_;
  std::optional<Instance> instance_;  ///< none where the device was handed in
  ValidationLog no_messages_;
  VkPhysicalDevice physical_ = VK_NULL_HANDLE;
  VkDevice device_ = VK_NULL_HANDLE;
  VkQueue queue_ = VK_NULL_HANDLE;
  std::mutex own_queue_mutex_;
  std::mutex* queue_mutex_ = &own_queue_mutex_;
  Pipelines pipelines_;
  std::uint32_t queue_family_ = 0;
  std::string name_;
  Limits limits_;
  VkPhysicalDeviceMemoryProperties memory_{};
  mutable std::mutex memory_use_mutex_;
  MemoryUse memory_use_;
};

}  // namespace palpate::gpu
