#include "call.hpp"

#include <csignal>

namespace palpate::python {

namespace {

using namespace std::chrono_literals;

constexpr auto tick = 20ms;         // how soon Ctrl-C is noticed
constexpr auto last_chance = 80ms;  // for work that stops soon, so that nothing stays behind

/// Calls that were given up and may still run. Guarded by the GIL.
std::vector<std::unique_ptr<Call>>& given_up_calls() {
  // Never destroyed: at the end of the process, work may still run.
  static auto* calls = new std::vector<std::unique_ptr<Call>>();
  return *calls;
}

}  // namespace

Call::Call(Work work, std::vector<nb::object> kept)
    : work_(std::move(work)), kept_(std::move(kept)) {
  // Signals are for Python's threads: they must not interrupt the work's system calls.
  sigset_t all;
  sigset_t before;
  ::sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, &before);
  thread_ = std::thread([this] {
    try {
      work_(*this);
    } catch (...) {
      failure_ = std::current_exception();
    }
    const std::lock_guard lock(mutex_);
    done_ = true;
    ended_.notify_all();
  });
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

Call::~Call() {
  if (thread_.joinable()) {
    const nb::gil_scoped_release release;
    thread_.join();
  }
}

void Call::check() const {
  if (given_up_) {
    throw Interrupted();
  }
}

std::function<void(double)> Call::progress() {
  return [this](double fraction) {
    check();
    fraction_ = fraction;
  };
}

bool Call::wait_for(std::chrono::milliseconds time) {
  const nb::gil_scoped_release release;
  std::unique_lock lock(mutex_);
  return ended_.wait_for(lock, time, [this] { return done_; });
}

void Call::wait(std::unique_ptr<Call> call, const Progress& progress) {
  std::erase_if(given_up_calls(), [](const auto& earlier) { return earlier->wait_for(0ms); });
  const bool shows = progress.is_valid() && !progress.is_none();
  double shown = 0.0;
  try {
    while (!call->wait_for(tick)) {
      if (PyErr_CheckSignals() != 0) {
        throw nb::python_error();
      }
      if (const double fraction = call->fraction_; shows && fraction != shown) {
        shown = fraction;
        progress(fraction);
      }
    }
  } catch (...) {
    give_up(std::move(call));
    throw;
  }
  if (call->failure_) {
    std::rethrow_exception(call->failure_);
  }
  if (shows) {
    progress(1.0);
  }
}

void Call::give_up(std::unique_ptr<Call> call) {
  call->given_up_ = true;
  if (!call->wait_for(last_chance)) {
    given_up_calls().push_back(std::move(call));
  }
}

void Call::wait_for_given_up() { given_up_calls().clear(); }

}  // namespace palpate::python
