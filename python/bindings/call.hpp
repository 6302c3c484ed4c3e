#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include <nanobind/nanobind.h>

#include "model/own_process.hpp"
#include "types.hpp"

namespace palpate::python {

/// Work that runs on a thread of its own while the thread that called it from Python waits without
/// the GIL: other threads of Python go on, and Ctrl-C ends the wait at once. Work that was given up
/// stops where it next reports its progress, in the background; what it uses lives until then. In a
/// child of fork(), the parent's calls are neither waited for nor destroyed.
class Call {
 public:
  using Work = std::function<void(Call&)>;

  /// @param kept objects of Python whose memory the work reads
  Call(Work work, std::vector<nb::object> kept);
  /// Waits for the work.
  ~Call();
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

  // For the work, on its thread.

  /// Throws Interrupted where the call was given up.
  void check() const;
  /// Takes note of the fraction done; throws as check() does.
  std::function<void(double)> progress();

  // For the thread that called, which holds the GIL.

  /// Waits for the work, then throws what the work threw.
  /// @param progress called on this thread with the fraction done, about 20 times a second
  /// @throws nb::python_error on Ctrl-C, or what `progress` throws; the work is then given up
  static void wait(const std::shared_ptr<Call>& call, const Progress& progress);
  /// Has the end of the interpreter give up the work of all threads and wait for it, since work
  /// uses libraries that the end of the process takes down. The threads stay where they are.
  static void end_all_at_exit();

  struct Interrupted {};

 private:
  static void end_all();
  bool is_done();
  bool wait_for(std::chrono::milliseconds time);
  void watch(const Progress& progress);

  OwnProcess process_;
  Work work_;
  std::vector<nb::object> kept_;
  std::atomic<double> fraction_{0.0};
  std::atomic<bool> given_up_{false};
  std::mutex mutex_;
  std::condition_variable ended_;
  bool done_ = false;
  std::exception_ptr failure_;
  std::thread thread_;
};

/// Runs `work(call)` as a Call and returns its result. The work must own all that it uses, or
/// `kept` must: it may outlive this function.
template <typename F>
auto run(std::vector<nb::object> kept, const Progress& progress, F work) {
  using Result = std::invoke_result_t<F&, Call&>;
  if constexpr (std::is_void_v<Result>) {
    Call::wait(std::make_shared<Call>(std::move(work), std::move(kept)), progress);
  } else {
    const auto result = std::make_shared<std::optional<Result>>();
    const auto shared = std::make_shared<F>(std::move(work));  // std::function copies
    Call::wait(std::make_shared<Call>([result, shared](Call& call) { *result = (*shared)(call); },
                                      std::move(kept)),
               progress);
    return std::move(**result);
  }
}

template <typename F>
auto run(F work) {
  return run({}, Progress(), std::move(work));
}

}  // namespace palpate::python
