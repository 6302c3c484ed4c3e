#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "context.hpp"
#include "owned.hpp"

namespace palpate::gpu {

/// How a kernel reaches a buffer.
enum class Access {
  table,    ///< reads it as a texel buffer: the fast way on every device for what is not written
  storage,  ///< reads and writes it as a storage buffer
};

VkDescriptorType descriptor_type(Access access);

/// A compute shader ready to run. Binding i of set 0 is bindings[i].
struct KernelInfo {
  const char* name = "";
  std::span<const std::uint32_t> spirv;
  std::span<const Access> bindings;
  std::uint32_t push_bytes = 0;
  std::span<const std::uint32_t> constants = {};  ///< specialization constants 0, 1, ... as bits
};

/// A compute pipeline with its layouts. Move-only.
class Kernel {
 public:
  Kernel() = default;
  /// @throws Error where the device's limits do not allow the kernel
  Kernel(Context& context, const KernelInfo& info);

  VkPipeline pipeline() const { return pipeline_.get(); }
  VkPipelineLayout layout() const { return layout_.get(); }
  VkDescriptorSetLayout set_layout() const { return set_layout_.get(); }
  std::span<const Access> bindings() const { return bindings_; }
  std::uint32_t push_bytes() const { return push_bytes_; }
  const char* name() const { return name_; }

 private:
  Owned<VkDescriptorSetLayout, vkDestroyDescriptorSetLayout> set_layout_;
  Owned<VkPipelineLayout, vkDestroyPipelineLayout> layout_;
  Owned<VkPipeline, vkDestroyPipeline> pipeline_;
  std::vector<Access> bindings_;
  std::uint32_t push_bytes_ = 0;
  const char* name_ = "";
};

}  // namespace palpate::gpu
