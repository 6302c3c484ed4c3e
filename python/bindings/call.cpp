#include "call.hpp"

#include <algorithm>
#include <csignal>
#include <iterator>

namespace palpate::python {

namespace {

using namespace std::chrono_literals;

constexpr auto tick = 20ms;         // how soon Ctrl-C is noticed
constexpr auto last_chance = 80ms;  // for work that stops soon, so that nothing stays behind

using Calls = std::vector<std::shared_ptr<Call>>;

/// Calls whose work may still run. Guarded by the GIL.
Calls& unfinished_calls() {
  // Never destroyed: at the end of the process, work may still run. A child of fork() has none of
  // it.
  static OwnProcess process;
  static auto* calls = new Calls();
  if (!process.is_here()) {
    process = OwnProcess();
    calls = new Calls();
    nb::set_leak_warnings(false);  // for what the parent's threads hold
  }
  return *calls;
}

}  // namespace

Call::Call(Work work, std::vector<nb::object> kept)
    : work_(std::move(work)), kept_(std::move(kept)) {
  if (WithoutGil::is_kept()) {
    const WithoutGil to_the_end;
  }
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
    const WithoutGil released;
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

bool Call::is_done() {
  const std::lock_guard lock(mutex_);
  return done_;
}

bool Call::wait_for(std::chrono::milliseconds time) {
  const WithoutGil released;
  std::unique_lock lock(mutex_);
  return ended_.wait_for(lock, time, [this] { return done_; });
}

void Call::watch(const Progress& progress) {
  const bool shows = progress.is_valid() && !progress.is_none();
  const auto show = [&](double fraction) {
    with_python([&] { progress(fraction); });
    process_.require("call");  // progress may have forked
  };
  double shown = 0.0;
  while (!wait_for(tick)) {
    if (PyErr_CheckSignals() != 0) {
      throw nb::python_error();
    }
    if (const double fraction = fraction_; shows && fraction != shown) {
      shown = fraction;
      show(fraction);
    }
  }
  if (failure_) {
    std::rethrow_exception(failure_);
  }
  if (shows) {
    show(1.0);
  }
}

void Call::wait(const std::shared_ptr<Call>& call, const Progress& progress) {
  const auto forget_done = [] {
    Calls& calls = unfinished_calls();
    const auto done =
        std::ranges::partition(calls, [](const auto& each) { return !each->is_done(); });
    // Destroyed outside the list: that may run code of Python.
    const Calls forgotten(std::make_move_iterator(done.begin()),
                          std::make_move_iterator(done.end()));
    calls.erase(done.begin(), done.end());
  };
  forget_done();
  unfinished_calls().push_back(call);
  try {
    call->watch(progress);
  } catch (...) {
    if (call->process_.is_here()) {
      call->given_up_ = true;
      call->wait_for(last_chance);
      forget_done();
    }
    throw;
  }
  forget_done();
}

void Call::end_all() {
  WithoutGil::keep_others();
  const Calls calls = unfinished_calls();
  for (const auto& call : calls) {
    call->given_up_ = true;
  }
  for (const auto& call : calls) {
    while (!call->wait_for(tick)) {
    }
  }
  unfinished_calls().clear();
  // What threads hold that stay is no leak.
  if (nb::cast<int>(nb::module_::import_("threading").attr("active_count")()) > 1) {
    nb::set_leak_warnings(false);
  }
}

void Call::end_all_at_exit() {
  nb::module_::import_("atexit").attr("register")(nb::cpp_function(&Call::end_all));
}

}  // namespace palpate::python
