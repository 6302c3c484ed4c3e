#include "call.hpp"

#include <atomic>
#include <chrono>
#include <thread>

#include <cxxabi.h>
#include <pthread.h>
#include <unistd.h>

namespace palpate::python {

namespace {

using Clock = std::chrono::steady_clock;

std::atomic<int> working = 0;                ///< threads that run the library's work
std::atomic<std::thread::id> ending_thread;  ///< none before the interpreter ends

/// Once the interpreter ends, only the thread that ends it goes on.
void begin_work() {
  ++working;
  const std::thread::id ending = ending_thread;
  if (ending != std::thread::id() && ending != std::this_thread::get_id()) {
    --working;
    for (;;) {
      ::pause();
    }
  }
}

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
    explicit WithGil(PyThreadState* state) {
      --working;
      take_gil(state);
    }
    ~WithGil() {
      PyEval_SaveThread();
      begin_work();
    }
  };
  const WithGil held(state);
  if (PyErr_CheckSignals() != 0) {
    throw nb::python_error();
  }
  use();
}

bool is_shown(const Progress& progress) { return progress.is_valid() && !progress.is_none(); }

}  // namespace

WithoutGil::WithoutGil() : state_(PyEval_SaveThread()) { begin_work(); }

WithoutGil::~WithoutGil() {
  --working;
  take_gil(state_);
}

void await_calls_at_exit() {
  // A child of fork() has none of its parent's other threads.
  pthread_atfork(nullptr, nullptr, [] { working = 0; });
  nb::module_::import_("atexit").attr("register")(nb::cpp_function([] {
    ending_thread = std::this_thread::get_id();
    const nb::gil_scoped_release released;
    for (int ms = 0; working > 0 && ms < 10'000; ++ms) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }));
}

bool calls_are_held() { return ending_thread.load() == std::this_thread::get_id(); }

void check_signals() {
  thread_local Clock::time_point next;
  now_and_then(next, [] {});
}

Report reporter(const Progress& progress) {
  if (!is_shown(progress)) {
    return [](double /*fraction*/) { check_signals(); };
  }
  // Of this call alone: a call that follows another at once shows its first fraction, too.
  return [&progress, next = Clock::time_point()](double fraction) mutable {
    now_and_then(next, [&] { progress(fraction); });
  };
}

void report_end(const Progress& progress) {
  if (is_shown(progress)) {
    progress(1.0);
  }
}

}  // namespace palpate::python
