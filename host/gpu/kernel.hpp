#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gpu/context.hpp"
#include "gpu/owned.hpp"

namespace palpate::gpu {

/// How a kernel reaches a buffer.
enum class Access {
  table,    ///< reads it as a texel buffer, on every device the fastest way to read
  storage,  ///< reads and writes it as a storage buffer
};

VkDescriptorType descriptor_type(Access access);

/// A compiled compute shader and its interface. bindings[i] describes binding i of set 0.
struct KernelInfo {
  const char* name = "";
  std::span<const std::uint32_t> spirv;
  std::vector<Access> bindings;
  std::uint32_t push_bytes = 0;
  std::vector<std::uint32_t> constants = {};  ///< bits of specialization constants 0, 1, ...
};

/// A compute pipeline with its layouts. Move-only.
class Kernel {
 public:
  Kernel() = default;
  /// @throws Error if the device's limits do not allow the kernel
  Kernel(Context& context, const KernelInfo& info);

  VkPipeline pipeline() const { return pipeline_.get(); }
  VkPipelineLayout layout() const { return layout_.get(); }
  VkDescriptorSetLayout set_layout() const { return set_layout_.get(); }
  std::span<const Access> bindings() const { return bindings_; }
  std::uint32_t push_bytes() const { return push_bytes_; }
  const char* name() const { return name_; }

 private:
  Owned<VkDescriptorSetLayout> set_layout_;
  Owned<VkPipelineLayout> layout_;
  Owned<VkPipeline> pipeline_;
  std::vector<Access> bindings_;
  std::uint32_t push_bytes_ = 0;
  const char* name_ = "";
};

}  // namespace palpate::gpu
