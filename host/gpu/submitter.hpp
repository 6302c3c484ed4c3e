#pragma once

#include "gpu/context.hpp"
#include "gpu/owned.hpp"
#include "gpu/run_queue.hpp"

namespace palpate::gpu {

/// Submits the recordings of one thread; owns its command buffer, fence and timestamps.
class Submitter {
 public:
  /// @throws Error if the device fails
  explicit Submitter(Context& context);

  /// Submits recordings side by side and waits for them. A barrier stands between the commands of
  /// each recording, and between the commands of different ones that stand at different places in
  /// theirs; the first commands of all run at once, then the second ones, and so on. The recordings
  /// must share no buffer that one of them writes.
  RunOutcome run(const WaitingRun& first) noexcept;

 private:
  VkResult encode(const WaitingRun& first);

  Context& context_;
  Owned<VkCommandPool> pool_;
  VkCommandBuffer commands_ = VK_NULL_HANDLE;
  Owned<VkFence> fence_;
  Owned<VkQueryPool> timestamps_;  ///< none where the queue has none
};

}  // namespace palpate::gpu
