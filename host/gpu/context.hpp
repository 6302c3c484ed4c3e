#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include <vulkan/vulkan.h>

#include "palpate/device.hpp"

namespace palpate::gpu {

/// What Vulkan's validation layer said, collected from its callback.
class ValidationLog {
 public:
  void add(std::string message);
  /// Throws Error with the first message, if there is any.
  void throw_if_any();
  bool empty();

 private:
  std::mutex mutex_;
  std::vector<std::string> messages_;
};

/// A Vulkan instance; with PALPATE_VALIDATION=1 in the environment the validation layer is on.
class Instance {
 public:
  Instance();
  ~Instance();
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;

  VkInstance handle() const { return instance_; }
  ValidationLog& validation() { return validation_; }

 private:
  VkInstance instance_ = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
  ValidationLog validation_;
};

/// Iterations that all loops of a kernel together may take in one invocation. lavapipe ends loops
/// after 65,535 iterations without a word; half of that leaves room for outer loops.
inline constexpr std::uint32_t most_iterations = 1 << 15;

/// Device limits that sizes are planned by.
struct Limits {
  std::uint32_t group_invocations = 0;  ///< of one workgroup
  std::uint32_t group_size[3] = {};     ///< invocations of one workgroup along each dimension
  std::uint32_t shared_bytes = 0;       ///< memory that the invocations of a workgroup share
  std::uint32_t subgroup = 0;           ///< invocations that run in step
  VkDeviceSize storage_range = 0;       ///< bytes of one storage-buffer binding
  VkDeviceSize allocation = 0;          ///< bytes of one allocation
  std::uint32_t table_texels = 0;       ///< elements of one texel buffer
  bool cpu = false;                     ///< a few cores that a few workgroups fill
  VkDeviceSize memory = 0;              ///< bytes of the largest heap of device memory
  std::uint32_t group_count[3] = {};
  std::uint32_t push_bytes = 0;
  std::uint64_t timestamp_mask = 0;  ///< the bits of a timestamp that count
  float timestamp_ns = 0.0F;         ///< 0 where the queue has no timestamps
};

/// Memory that buffers hold, staging included, in bytes.
struct MemoryUse {
  VkDeviceSize now = 0;
  VkDeviceSize peak = 0;
};

/// A logical device with one compute queue.
class Context {
 public:
  explicit Context(std::string_view name_or_index);
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  VkDevice device() const { return device_; }
  VkQueue queue() const { return queue_; }
  std::uint32_t queue_family() const { return queue_family_; }
  const std::string& name() const { return name_; }
  const Limits& limits() const { return limits_; }
  ValidationLog& validation() { return instance_.validation(); }
  /// Plans by limits below the device's own, so that a test reaches on any device what only much
  /// smaller devices or much larger problems would.
  void lower_limits(const Limits& limits) { limits_ = limits; }

  const MemoryUse& memory_use() const { return memory_use_; }
  /// Called by buffers as they take memory and give it back.
  void take_memory(VkDeviceSize bytes);
  void give_memory(VkDeviceSize bytes) { memory_use_.now -= bytes; }

  /// The first memory type allowed by `type_bits` that has all of `flags`.
  /// Throws Error where there is none.
  std::uint32_t memory_type(std::uint32_t type_bits, VkMemoryPropertyFlags flags,
                            VkMemoryPropertyFlags preferred) const;

 private:
  Instance instance_;
  VkPhysicalDevice physical_ = VK_NULL_HANDLE;
  VkDevice device_ = VK_NULL_HANDLE;
  VkQueue queue_ = VK_NULL_HANDLE;
  std::uint32_t queue_family_ = 0;
  std::string name_;
  Limits limits_;
  VkPhysicalDeviceMemoryProperties memory_{};
  MemoryUse memory_use_;
};

}  // namespace palpate::gpu
