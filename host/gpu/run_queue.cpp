#include "run_queue.hpp"

#include <cstddef>
#include <cstdint>

#include "recording.hpp"
#include "submitter.hpp"

namespace palpate::gpu {

namespace {

/// Workgroups of a dispatch that fills a device by itself: the largest GPUs hold about so many
/// workgroups of 64 lanes at once.
constexpr std::uint64_t filling_groups = 4096;
/// Bounds how long a submission keeps the device from others.
constexpr std::size_t most_together = 16;
/// The next submission is ready when the device finishes one.
constexpr int most_submitted = 2;

bool is_small(const WaitingRun& run) { return run.recording->most_groups() < filling_groups; }

}  // namespace

void WaitingLine::add(WaitingRun& last) {
  last.next = nullptr;
  (front_ == nullptr ? front_ : back_->next) = &last;
  back_ = &last;
}

WaitingRun* WaitingLine::take() {
  WaitingRun* const first = front_;
  WaitingRun* rest = first->next;
  front_ = nullptr;
  back_ = nullptr;
  first->next = nullptr;
  WaitingRun* last = first;
  std::size_t together = 1;
  while (rest != nullptr) {
    WaitingRun& run = *rest;
    rest = run.next;
    if (is_small(*first) && is_small(run) && together < most_together) {
      run.next = nullptr;
      last->next = &run;
      last = &run;
      ++together;
    } else {
      add(run);
    }
  }
  return first;
}

RunOutcome RunQueue::run(const Recording& recording, Submitter& own) {
  WaitingRun mine{.recording = &recording};
  std::unique_lock lock(mutex_);
  line_.add(mine);
  changed_.wait(lock, [&] {
    return mine.outcome || (submitted_ < most_submitted && line_.front() == &mine);
  });
  if (mine.outcome) {
    return *mine.outcome;  // another thread has submitted it
  }
  WaitingRun* const together = line_.take();
  ++submitted_;
  // Whoever stands in front now may find room for one more submission.
  changed_.notify_all();
  lock.unlock();
  const RunOutcome outcome = own.run(*together);
  lock.lock();
  --submitted_;
  for (WaitingRun* run = together; run != nullptr;) {
    WaitingRun* const next = run->next;  // its thread may end it once it has its outcome
    run->outcome = outcome;
    run = next;
  }
  changed_.notify_all();
  return outcome;
}

}  // namespace palpate::gpu
