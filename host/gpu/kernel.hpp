#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "gpu/owned.hpp"

namespace palpate::gpu {

class Context;

/// How a kernel reaches a buffer.
enum class Access {
  table,    ///< reads it as a texel buffer, on every device the fastest way to read
  storage,  ///< reads and writes it as a storage buffer
};

/// A compiled compute shader and its interface. bindings[i] describes binding i of set 0.
struct KernelInfo {
  const char* name = "";
  std::span<const std::uint32_t> spirv;  ///< of static storage
  std::vector<Access> bindings;
  std::uint32_t push_bytes = 0;
  std::vector<std::uint32_t> constants = {};  ///< bits of specialization constants 0, 1, ...
};

/// A compute pipeline with its layouts, and what it was made of.
struct Pipeline {
  KernelInfo info;
  Owned<VkDescriptorSetLayout> set_layout;
  Owned<VkPipelineLayout> layout;
  Owned<VkPipeline> pipeline;
};

/// The pipelines that a device used last. Drivers compile for 10 to 100 ms what the next filter or
/// map builder of the same kind needs again. Threads may use it at the same time.
class Pipelines {
 public:
  /// The pipeline of `info`: one that is kept, else what make() makes.
  std::shared_ptr<const Pipeline> get(const KernelInfo& info,
                                      const std::function<Pipeline()>& make);
  void clear();

 private:
  std::mutex mutex_;
  std::list<std::shared_ptr<const Pipeline>> kept_;  ///< the last used first
};

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
