#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>

#include <vulkan/vulkan_core.h>

namespace palpate::gpu {

class Recording;
class Submitter;

/// How a submission went.
struct RunOutcome {
  VkResult result = VK_SUCCESS;
  double seconds = 0.0;  ///< time that the device took
};

/// A recording that its thread waits for.
struct WaitingRun {
  const Recording* recording = nullptr;
  WaitingRun* next = nullptr;  ///< in the line, then in the submission
  std::optional<RunOutcome> outcome = {};
};

/// Recordings in the order in which they came. A list through the elements: it takes no memory.
class WaitingLine {
 public:
  void add(WaitingRun& last);
  const WaitingRun* front() const { return front_; }
  /// Takes the front out, and with it others, as far as all together are little work: they fill a
  /// device that one of them would leave idle. Returns the front, with the others behind it.
  WaitingRun* take();

 private:
  WaitingRun* front_ = nullptr;
  WaitingRun* back_ = nullptr;
};

/// Runs the recordings of several threads on one device. Those that come while the device is busy
/// wait. Where they are little work, they are then submitted together, side by side, so that a GPU
/// can work at the dispatches of all of them at once. A recording of much work is submitted by
/// itself.
class RunQueue {
 public:
  /// Runs a recording and waits for it.
  /// @param own the submitter of the calling thread
  RunOutcome run(const Recording& recording, Submitter& own);

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  WaitingLine line_;
  int submitted_ = 0;  ///< submissions that the device has not finished
};

}  // namespace palpate::gpu
