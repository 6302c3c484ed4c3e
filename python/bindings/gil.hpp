#pragma once

#include <atomic>
#include <thread>

#include <cxxabi.h>
#include <nanobind/nanobind.h>
#include <unistd.h>

namespace palpate::python {

// Before 3.14, CPython ends a daemon thread that asks for the GIL after the interpreter has begun
// to end: it unwinds the thread's stack, which no noexcept function survives, and destroys Python's
// objects without the GIL. Here such a thread stays where it is until the process ends, as later
// versions of CPython have it.

/// Waits for the end of the process, without the GIL.
[[noreturn]] inline void stay() {
  for (;;) {
    ::pause();
  }
}

/// Calls what may run code of Python, which lets other threads take the GIL.
template <typename F>
auto with_python(F call) {
  try {
    return call();
  } catch (const abi::__forced_unwind&) {
    stay();
  }
}

/// Leaves the GIL to other threads while it lives.
class WithoutGil {
 public:
  WithoutGil() : state_(PyEval_SaveThread()) {}
  ~WithoutGil() {
    if (is_kept()) {
      stay();
    }
    with_python([this] { PyEval_RestoreThread(state_); });
  }
  WithoutGil(const WithoutGil&) = delete;
  WithoutGil& operator=(const WithoutGil&) = delete;

  /// From now on, threads other than this one do not come back; for the end of the interpreter.
  static void keep_others() { ending_ = std::this_thread::get_id(); }
  /// Whether this thread would not come back.
  static bool is_kept() {
    const std::thread::id by = ending_;
    return by != std::thread::id() && by != std::this_thread::get_id();
  }

 private:
  /// The thread that ends the interpreter; none while it runs.
  inline static std::atomic<std::thread::id> ending_;

  PyThreadState* state_;
};

}  // namespace palpate::python
