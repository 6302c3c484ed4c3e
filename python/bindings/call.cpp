#include "call.hpp"

#include <chrono>

#include <cxxabi.h>
#include <unistd.h>

namespace palpate::python {

namespace {

using Clock = std::chrono::steady_clock;

/// Once the interpreter ends, CPython before 3.14 unwinds the stack of a daemon thread that asks
/// for the GIL, which no noexcept function survives. Such a thread then waits here, as later
/// versions have it.
void take_gil(PyThreadState* state) {
  try {
    PyEval_RestoreThread(state);
  } catch (const abi::__forced_unwind&) {
    for (;;) {
      ::pause();
    }
  }
}

/// Calls `use()` with the GIL, where this is a thread of Python's and the last time was a while
/// ago. Threads of a library's own have no GIL to give back.
template <typename F>
void now_and_then(Clock::time_point& next, F use) {
  PyThreadState* state = PyGILState_GetThisThreadState();
  const Clock::time_point now = Clock::now();
  if (state == nullptr || now < next) {
    return;
  }
  next = now + std::chrono::milliseconds(50);
  struct WithGil {
    explicit WithGil(PyThreadState* state) { take_gil(state); }
    ~WithGil() { PyEval_SaveThread(); }
  };
  const WithGil held(state);
  if (PyErr_CheckSignals() != 0) {
    throw nb::python_error();
  }
  use();
}

bool is_shown(const Progress& progress) { return progress.is_valid() && !progress.is_none(); }

}  // namespace

WithoutGil::~WithoutGil() { take_gil(state_); }

void check_signals() {
  thread_local Clock::time_point next;
  now_and_then(next, [] {});
}

Report reporter(const Progress& progress) {
  // Of this call alone: a call that follows another at once shows its first fraction, too.
  return [&progress, next = Clock::time_point()](double fraction) mutable {
    now_and_then(next, [&] {
      if (is_shown(progress)) {
        progress(fraction);
      }
    });
  };
}

void report_end(const Progress& progress) {
  if (is_shown(progress)) {
    progress(1.0);
  }
}

}  // namespace palpate::python
