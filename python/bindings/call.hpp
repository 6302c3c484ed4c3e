#pragma once

#include <functional>
#include <type_traits>

#include <nanobind/nanobind.h>

#include "types.hpp"

namespace palpate::python {

/// Leaves the GIL to other threads while it lives.
class WithoutGil {
 public:
  WithoutGil();
  ~WithoutGil();
  WithoutGil(const WithoutGil&) = delete;
  WithoutGil& operator=(const WithoutGil&) = delete;

 private:
  PyThreadState* state_;
};

/// Registers with Python's atexit: calls of daemon threads stop at their next report or check, or
/// return, before the process takes down what they use. Waits ten seconds for them at most.
void await_calls_at_exit();

/// For work without the GIL: has Python handle signals, about 20 times a second. Only the thread
/// that Python called from does so, and of these the main thread alone has signals to handle.
/// @throws nb::python_error where a handler raises, as that of Ctrl-C does
void check_signals();

/// What work tells the fraction done; throws as check_signals() does, and what `progress` raises.
using Report = std::function<void(double)>;
/// @param progress outlives the report
Report reporter(const Progress& progress);
/// Calls progress(1.0), with the GIL.
void report_end(const Progress& progress);

/// Runs `work()` without the GIL and returns its result.
template <typename F>
auto run(F work) {
  const WithoutGil released;
  return work();
}

/// Runs `work(report)` without the GIL. `progress` is called on this thread, about 20 times a
/// second and at the end.
template <typename F>
auto run(const Progress& progress, F work) {
  const auto reported = [&] { return work(reporter(progress)); };
  if constexpr (std::is_void_v<std::invoke_result_t<F&, Report>>) {
    run(reported);
    report_end(progress);
  } else {
    auto result = run(reported);
    report_end(progress);
    return result;
  }
}

}  // namespace palpate::python
