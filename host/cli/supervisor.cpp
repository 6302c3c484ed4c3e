#include "cli/supervisor.hpp"

#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <ctime>
#include <iterator>
#include <new>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "io/input_file.hpp"
#include "io/watched_reading.hpp"
#include "palpate/error.hpp"

namespace palpate::cli {

namespace {

// What ends a program that goes wrong.
constexpr int faults[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};

[[noreturn]] void fail(const char* action) {
  throw Error(Fault::system, fmt::format("cannot {}: {}; end other programs and try again", action,
                                         std::strerror(errno)));
}

WatchedReading& shared_reading() {
  void* const memory = ::mmap(nullptr, sizeof(WatchedReading), PROT_READ | PROT_WRITE,
                              MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) {
    fail("share memory with the process that reads files");
  }
  return *new (memory) WatchedReading();
}

/// The signals that the supervisor takes: those that other programs and terminals send.
sigset_t taken_signals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal :
       {SIGCHLD, SIGINT, SIGQUIT, SIGTERM, SIGHUP, SIGUSR1, SIGUSR2, SIGTSTP, SIGTTIN, SIGTTOU}) {
    sigaddset(&set, signal);
  }
  return set;
}

WatchedReading* reading_of_child = nullptr;

/// Clears the file of a crash in a thread that does not read it. Then the crash takes its course.
/// Without a stack of its own, this is not called for a stack that has overflown: the file is.
void on_fault(int signal) {
  if (reading_of_child->thread != ::gettid()) {
    reading_of_child->file[0] = '\0';
  }
  ::raise(signal);  // once this function is left
}

/// In the child: lets `reading` tell what it reads, unless another thread crashes.
void watch_child(WatchedReading& reading, BrokenFiles broken) {
  reading_of_child = &reading;
  struct sigaction action {};
  action.sa_handler = on_fault;
  action.sa_flags = SA_RESETHAND;
  for (const int signal : faults) {
    struct sigaction present {};
    // A sanitizer's stays.
    if (::sigaction(signal, nullptr, &present) == 0 && present.sa_handler == SIG_DFL) {
      ::sigaction(signal, &action, nullptr);
    }
  }
  watch_reading(reading, std::move(broken));
}

/// A child that has ended.
struct Ending {
  int status = 0;      ///< of waitpid()
  bool hangs = false;  ///< it was killed in a step that never ends
};

/// Waits for the end of the child, to which it passes signals on.
Ending wait_for(pid_t child, const sigset_t& signals, const WatchedReading& reading) {
  // Time is counted in waits, not by a clock: who was stopped for an hour has not waited an hour.
  constexpr timespec second{.tv_sec = 1, .tv_nsec = 0};
  Ending ending;
  std::uint64_t step = 0;
  std::uint64_t waited_s = 0;
  for (;;) {
    siginfo_t sent{};
    const int signal = ::sigtimedwait(&signals, &sent, &second);
    // The child has a terminal's keys from the terminal; only its end may be told to one process.
    if (signal > 0 && signal != SIGCHLD && (sent.si_code != SI_KERNEL || signal == SIGHUP)) {
      ::kill(child, signal);
    }
    while (::waitpid(child, &ending.status, WNOHANG | WUNTRACED) == child) {
      if (!WIFSTOPPED(ending.status)) {
        return ending;
      }
      ::raise(SIGSTOP);  // for the shell that waits for this process
      ::kill(child, SIGCONT);
    }
    if (signal >= 0) {
      continue;
    }
    const bool same_step = reading.file[0] != '\0' && reading.steps == step;
    waited_s = same_step ? waited_s + 1 : 0;
    step = reading.steps;
    if (waited_s > reading.patience_s) {
      ::kill(child, SIGKILL);
      // Unless a dead disk holds the child in the kernel, the next wait returns.
      if (std::exchange(ending.hangs, true)) {
        return ending;
      }
    }
  }
}

/// Ends this process as the child has ended.
[[noreturn]] void end_as(int status) {
  if (WIFEXITED(status)) {
    ::_exit(WEXITSTATUS(status));
  }
  ::prctl(PR_SET_DUMPABLE, 0);  // the core that tells something is the child's
  std::signal(WTERMSIG(status), SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::raise(WTERMSIG(status));
  ::_exit(128 + WTERMSIG(status));  // as a shell says it: nothing kills a container's first process
}

/// What is wrong with the file that the child read as it ended; "" where somebody else ended it.
std::string fault_of_file(const Ending& ending) {
  if (ending.hangs) {
    return "cannot be read: a step of the HDF5 library takes over a minute; the file is damaged, "
           "or its disk does not answer: copy it to another disk, or record it again";
  }
  const bool faulty = !WIFSIGNALED(ending.status) ||  // a sanitizer ends the program by exit()
                      std::ranges::find(faults, WTERMSIG(ending.status)) != std::end(faults);
  return faulty ? "is damaged: the HDF5 library failed on it; copy or record it again" : "";
}

}  // namespace

// Opening a file and reading a piece of it take milliseconds; disks and networks pause.
void supervise(Restart restart, std::uint64_t patience_s) {
  WatchedReading& reading = shared_reading();
  reading.least_patience_s = patience_s;
  const sigset_t signals = taken_signals();
  sigset_t before;
  ::sigprocmask(SIG_BLOCK, &signals, &before);
  std::signal(SIGCHLD, SIG_DFL);  // children of a process that ignores it leave no status
  const pid_t supervisor = ::getpid();
  for (BrokenFiles broken;;) {
    const pid_t child = ::fork();
    if (child < 0) {
      fail("fork");
    }
    if (child == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      if (::getppid() != supervisor) {
        ::_exit(1);
      }
      ::sigprocmask(SIG_SETMASK, &before, nullptr);
      watch_child(reading, std::move(broken));
      return;
    }
    const Ending ending = wait_for(child, signals, reading);
    const std::string file = reading.file;
    if (file.empty()) {
      end_as(ending.status);
    }
    if (WIFSIGNALED(ending.status) && WTERMSIG(ending.status) == SIGKILL && !ending.hangs) {
      refuse(file,
             "was being read when the command was killed, as where a damaged file takes all "
             "memory; copy or record it again");
    }
    const std::string fault = fault_of_file(ending);
    if (fault.empty()) {
      end_as(ending.status);
    }
    if (restart == Restart::never) {
      refuse(file, "{}", fault);
    }
    broken.emplace(file, fault);
    reading.file[0] = '\0';
  }
}

}  // namespace palpate::cli
