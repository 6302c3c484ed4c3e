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

/// At the interpreter's end, waits (ten seconds at most) until no other thread is in the library:
/// calls of daemon threads stop for good at their next report or check, or at their return. Threads
/// of the library's own are not waited for.
void await_calls_at_exit();
/// Whether this thread ends the interpreter, and calls of all others have stopped for good, with
/// what they hold.
bool calls_are_held();

/// For work without the GIL: has Python handle signals, about 20 times a second. Does nothing on
/// threads that are not Python's; handlers run on the main thread only.
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
