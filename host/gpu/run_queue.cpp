#include "gpu/run_queue.hpp"

#include <cstddef>

#include "gpu/recording.hpp"
#include "gpu/submitter.hpp"

namespace palpate::gpu {

namespace {

/// Work of recordings that are submitted together, see Recording::work(): about as much as a small
/// GPU does in 25 ms, and two cores in 400 ms, so that none waits long for the others.
constexpr double most_work = 5e8;
constexpr std::size_t most_together = 16;
/// The next submission is ready when the device finishes one.
constexpr int most_submitted = 2;

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
  double work = first->recording->work();
  while (rest != nullptr) {
    WaitingRun& run = *rest;
    rest = run.next;
    if (together < most_together && work + run.recording->work() <= most_work) {
      work += run.recording->work();
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
  for (WaitingRun* run = together; run != nullptr; run = run->next) {
    run->outcome = outcome;
  }
  changed_.notify_all();
  return outcome;
}

}  // namespace palpate::gpu
