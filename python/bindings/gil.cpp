#include "gil.hpp"

#include <atomic>
#include <thread>

namespace palpate::python {

namespace {

/// The thread that ends the interpreter; none while it runs.
std::atomic<std::thread::id> ending;

}  // namespace

WithoutGil::~WithoutGil() {
  if (is_kept()) {
    stay();
  }
  with_python([this] { PyEval_RestoreThread(state_); });
}

void WithoutGil::keep_others() { ending = std::this_thread::get_id(); }

bool WithoutGil::is_kept() {
  const std::thread::id by = ending;
  return by != std::thread::id() && by != std::this_thread::get_id();
}

}  // namespace palpate::python
