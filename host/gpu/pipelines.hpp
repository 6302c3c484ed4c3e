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

}  // namespace palpate::gpu
