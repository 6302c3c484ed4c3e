#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "gpu/context.hpp"
#include "gpu/pipelines.hpp"

namespace palpate::gpu {

VkDescriptorType descriptor_type(Access access);

/// A kernel's pipeline, which it shares with the device's other kernels of the same code, interface
/// and constants.
class Kernel {
 public:
  Kernel() = default;
  /// @throws Error if the device's limits do not allow the kernel
  Kernel(Context& context, const KernelInfo& info);

  VkPipeline pipeline() const { return pipeline_->pipeline.get(); }
  VkPipelineLayout layout() const { return pipeline_->layout.get(); }
  VkDescriptorSetLayout set_layout() const { return pipeline_->set_layout.get(); }
  std::span<const Access> bindings() const { return pipeline_->info.bindings; }
  std::uint32_t push_bytes() const { return pipeline_->info.push_bytes; }
  const char* name() const { return pipeline_->info.name; }

 private:
  std::shared_ptr<const Pipeline> pipeline_ = std::make_shared<const Pipeline>();
};

}  // namespace palpate::gpu
