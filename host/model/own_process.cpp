#include "model/own_process.hpp"

#include <pthread.h>

#include <atomic>

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate {

namespace {

std::atomic<unsigned> forks{0};  ///< that lie between the first object's process and this one

}  // namespace

OwnProcess::OwnProcess() {
  // Reading a counter is cheaper than asking the kernel for the process's number.
  static const int registered = ::pthread_atfork(nullptr, nullptr, [] { ++forks; });
  static_cast<void>(registered);
  forks_ = forks;
}

bool OwnProcess::is_here() const { return forks_ == forks.load(std::memory_order_relaxed); }

void OwnProcess::require(const char* name) const {
  if (!is_here()) {
    throw Error(
        Fault::input,
        fmt::format("{}: belongs to the parent process, whose devices do not survive fork(); "
                    "open devices in the child alone, or start processes without fork (in "
                    "Python with the start method \"spawn\")",
                    name));
  }
}

}  // namespace palpate
