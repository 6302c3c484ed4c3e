#include "io/forked_child.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <optional>

#include "palpate/error.hpp"

namespace palpate {

namespace {

using namespace std::chrono_literals;

[[noreturn]] void fail(const char* action) {
  throw Error(Fault::system,
              fmt::format("cannot {} to use a file in a child process: {}; end other programs and "
                          "try again",
                          action, std::strerror(errno)));
}

/// An answer has many small parts: together so many bytes cost one system call.
constexpr std::size_t together = 1 << 14;

/// Private writable memory of this process in bytes, about as RLIMIT_DATA counts it; none where the
/// system does not tell.
std::optional<std::uint64_t> data_bytes() {
  std::uint64_t pages[6] = {};  // size, resident, shared, text, library, data
  std::ifstream statm("/proc/self/statm");
  for (std::uint64_t& field : pages) {
    statm >> field;
  }
  return statm ? std::optional(pages[5] * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)))
               : std::nullopt;
}

/// Sets a soft limit, which the child raises as it learns what it has to read.
void limit(__rlimit_resource resource, std::uint64_t most) {
  rlimit present{};
  if (::getrlimit(resource, &present) == 0) {
    present.rlim_cur = std::min<rlim_t>(most, present.rlim_max);
    ::setrlimit(resource, &present);
  }
}

[[noreturn]] void run_child(const ForkedChild::Work& work, int socket, const ForkedLimits& limits) {
  // The embedding program's handlers must not see this child's crash, and its signal mask must not
  // block the signals of the limits.
  sigset_t fatal;
  sigemptyset(&fatal);
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGPIPE, SIGXCPU}) {
    std::signal(signal, SIG_DFL);
    sigaddset(&fatal, signal);
  }
  ::pthread_sigmask(SIG_UNBLOCK, &fatal, nullptr);
  ::prctl(PR_SET_DUMPABLE, 0);
  allow_cpu_seconds(limits.cpu_seconds);
  allow_memory_bytes(limits.memory_bytes);
  // The C library and sanitizers report a corrupted heap on standard error.
  const Descriptor nowhere("/dev/null", O_RDWR);
  for (const int standard : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    ::dup2(nowhere.get(), standard);
  }
  try {
    work(socket);
  } catch (...) {
    ::_exit(1);
  }
  ::_exit(0);
}

/// Waits until there is something to read. Time is counted in waits without an answer, not by a
/// clock: a process that was stopped for an hour has not waited for an hour.
bool wait_for_answer(int socket, std::chrono::milliseconds silence) {
  while (silence > 0ms) {
    const auto slice = std::min<std::chrono::milliseconds>(silence, 1s);
    pollfd ready{.fd = socket, .events = POLLIN, .revents = 0};
    const int count = ::poll(&ready, 1, static_cast<int>(slice.count()));
    if (count > 0) {
      return true;
    }
    if (count == 0) {
      silence -= slice;
    } else if (errno != EINTR) {
      return false;
    }
  }
  return false;
}

/// Reads what has come, at most so many bytes; 0 where the other end is gone.
std::size_t read_some(int socket, void* data, std::size_t most) {
  for (;;) {
    const ssize_t got = ::read(socket, data, most);
    if (got >= 0 || errno != EINTR) {
      return static_cast<std::size_t>(std::max<ssize_t>(got, 0));
    }
  }
}

/// Writes all bytes; false where the other end is gone.
bool write_all(int socket, const void* data, std::size_t bytes) {
  const char* rest = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t written = ::send(socket, rest, bytes, MSG_NOSIGNAL);
    if (written > 0) {
      rest += written;
      bytes -= static_cast<std::size_t>(written);
    } else if (errno != EINTR) {
      return false;
    }
  }
  return true;
}

}  // namespace

ForkedChild::ForkedChild(const Work& work, const ForkedLimits& limits, std::mutex& held)
    : silence_(limits.silence) {
  // No other child of this class is forked meanwhile and keeps the socket open.
  const std::lock_guard lock(held);
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
    fail("open a socket");
  }
  socket_ = Descriptor(ends[0]);
  const Descriptor childs(ends[1]);
  if (!socket_.valid() || !childs.valid()) {
    fail("open a socket");
  }
  pid_ = ::fork();
  if (pid_ == 0) {
    socket_ = Descriptor();
    run_child(work, childs.get(), limits);
  }
  if (pid_ < 0) {
    fail("fork");
  }
}

ForkedChild::~ForkedChild() {
  // 0: the child still runs. Otherwise somebody has waited for it, and its number may belong to
  // another process.
  if (::waitpid(pid_, nullptr, WNOHANG) != 0) {
    return;
  }
  ::kill(pid_, SIGKILL);
  // A child that a dead disk holds in the kernel ends only when the disk lets go.
  constexpr int patience_ms = 2000;
  pollfd gone{.fd = socket_.get(), .events = 0, .revents = 0};
  const int options = ::poll(&gone, 1, patience_ms) == 0 ? WNOHANG : 0;
  while (::waitpid(pid_, nullptr, options) < 0 && errno == EINTR) {
  }
}

std::size_t ForkedChild::receive(char* data, std::size_t most) {
  fell_silent_ = !wait_for_answer(socket_.get(), silence_);
  return fell_silent_ ? 0 : read_some(socket_.get(), data, most);
}

bool ForkedChild::read(void* data, std::size_t bytes) {
  char* rest = static_cast<char*>(data);
  while (bytes > 0) {
    const std::size_t here = std::min(bytes, received_.size() - next_);
    std::copy_n(received_.data() + next_, here, rest);
    next_ += here;
    rest += here;
    bytes -= here;
    if (bytes >= together) {
      const std::size_t got = receive(rest, bytes);
      rest += got;
      bytes -= got;
      if (got == 0) {
        return false;
      }
    } else if (bytes > 0) {
      received_.resize(together);
      received_.resize(receive(received_.data(), together));
      next_ = 0;
      if (received_.empty()) {
        return false;
      }
    }
  }
  return true;
}

bool ForkedChild::write(const void* data, std::size_t bytes) {
  return write_all(socket_.get(), data, bytes);
}

void forked_read(int socket, void* data, std::size_t bytes) {
  char* rest = static_cast<char*>(data);
  while (bytes > 0) {
    const std::size_t got = read_some(socket, rest, bytes);
    if (got == 0) {
      ::_exit(0);
    }
    rest += got;
    bytes -= got;
  }
}

void forked_write(int socket, const void* data, std::size_t bytes) {
  if (!write_all(socket, data, bytes)) {
    ::_exit(1);
  }
}

void ForkedSender::put(const void* data, std::size_t bytes) {
  if (waiting_.size() + bytes > together) {
    flush();
  }
  if (bytes > together) {
    forked_write(socket_, data, bytes);
  } else {
    const char* const from = static_cast<const char*>(data);
    waiting_.insert(waiting_.end(), from, from + bytes);
  }
}

void ForkedSender::flush() {
  forked_write(socket_, waiting_.data(), waiting_.size());
  waiting_.clear();
}

void allow_cpu_seconds(std::uint64_t seconds) {
  rusage used{};
  ::getrusage(RUSAGE_SELF, &used);
  const auto spent = static_cast<std::uint64_t>(used.ru_utime.tv_sec + used.ru_stime.tv_sec);
  limit(RLIMIT_CPU, spent + seconds);
}

void allow_memory_bytes(std::uint64_t bytes) {
  // Without the present size, the limit might be below what the process holds.
  if (const std::optional<std::uint64_t> held = data_bytes()) {
    limit(RLIMIT_DATA, bytes < UINT64_MAX - *held ? *held + bytes : UINT64_MAX);
  }
}

}  // namespace palpate
