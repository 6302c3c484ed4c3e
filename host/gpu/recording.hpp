#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <variant>
#include <vector>

#include "gpu/kernel.hpp"

namespace palpate::gpu {

/// Copies and dispatches that wait to be run in order, each of which sees the results of all before
/// it. Buffers, kernels and descriptor sets must live until then.
class Recording {
 public:
  void copy(VkBuffer source, VkBuffer target, const VkBufferCopy& region) {
    commands_.emplace_back(Copy{source, target, region});
  }
  /// Sets every 32-bit word of the buffer to `word`.
  void fill(VkBuffer target, std::uint32_t word) { commands_.emplace_back(Fill{target, word}); }
  /// @param work see work()
  void dispatch(const Kernel& kernel, VkDescriptorSet buffers, std::span<const std::byte> push,
                const std::array<std::uint32_t, 3>& groups, double work);
  /// Forgets all commands; keeps their memory.
  void clear();

  bool empty() const { return commands_.empty(); }
  std::size_t commands() const { return commands_.size(); }
  /// Bins, particles or their like times the loop iterations for each, of all dispatches.
  double work() const { return work_; }

  /// Adds one command to a command buffer.
  void encode(std::size_t command, VkCommandBuffer to) const;

 private:
  struct Copy {
    VkBuffer source;
    VkBuffer target;
    VkBufferCopy region;
  };
  struct Fill {
    VkBuffer target;
    std::uint32_t word;
  };
  struct Dispatch {
    VkPipeline pipeline;
    VkPipelineLayout layout;
    VkDescriptorSet buffers;
    std::size_t push_first;
    std::uint32_t push_bytes;
    std::array<std::uint32_t, 3> groups;
  };

  static void encode(const Copy& copy, VkCommandBuffer to);
  static void encode(const Fill& fill, VkCommandBuffer to);
  void encode(const Dispatch& dispatch, VkCommandBuffer to) const;

  std::vector<std::variant<Copy, Fill, Dispatch>> commands_;
  std::vector<std::byte> push_;  ///< constants of all dispatches
  double work_ = 0.0;
};

}  // namespace palpate::gpu
