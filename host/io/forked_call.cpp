#include "forked_call.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>

#include "palpate/error.hpp"

namespace palpate {

namespace {

[[noreturn]] void fail(const char* action) {
  throw Error(Fault::system,
              fmt::format("cannot {} to read a file in a child process: {}; end other programs and "
                          "try again",
                          action, std::strerror(errno)));
}

/// Private writable memory of this process, as RLIMIT_DATA counts it.
std::uint64_t data_bytes() {
  std::uint64_t pages[6] = {};  // size, resident, shared, text, library, data
  std::ifstream statm("/proc/self/statm");
  for (std::uint64_t& field : pages) {
    statm >> field;
  }
  return pages[5] * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

struct Child {
  pid_t pid;
  int answer;  ///< the reading end of its pipe

  ~Child() {
    // A child that is still writing ends when nobody reads.
    ::close(answer);
    while (::waitpid(pid, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
};

void limit(__rlimit_resource resource, std::uint64_t most) {
  rlimit present{};
  if (::getrlimit(resource, &present) == 0 && most < present.rlim_max) {
    // Hard, not soft: the signal that a soft one sends may be blocked or handled.
    const rlimit lowered{.rlim_cur = most, .rlim_max = most};
    ::setrlimit(resource, &lowered);
  }
}

[[noreturn]] void run_child(const std::function<void(int)>& work, int descriptor,
                            std::uint64_t cpu_seconds, std::uint64_t data_limit) {
  // Handlers of the embedding program must not see this child's crash.
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGPIPE}) {
    std::signal(signal, SIG_DFL);
  }
  ::prctl(PR_SET_DUMPABLE, 0);
  limit(RLIMIT_CPU, cpu_seconds);
  limit(RLIMIT_DATA, data_limit);
  // The C library and sanitizers report a corrupted heap on standard error.
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  ::dup2(nowhere, STDOUT_FILENO);
  ::dup2(nowhere, STDERR_FILENO);
  try {
    work(descriptor);
  } catch (...) {
    ::_exit(1);
  }
  ::_exit(0);
}

}  // namespace

std::string forked_call(const std::function<void(int)>& work, const ForkedLimits& limits) {
  const std::uint64_t data_limit = data_bytes() + limits.memory_bytes;
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) {
    fail("open a pipe");
  }
  const pid_t pid = ::fork();
  if (pid == 0) {
    ::close(ends[0]);
    run_child(work, ends[1], limits.cpu_seconds, data_limit);
  }
  ::close(ends[1]);
  if (pid < 0) {
    ::close(ends[0]);
    fail("fork");
  }
  const Child child{pid, ends[0]};
  constexpr std::size_t piece = 1 << 16;  // a pipe's capacity
  std::string answer;
  std::size_t size = 0;
  while (size <= limits.memory_bytes) {
    if (answer.size() - size < piece) {
      answer.resize(2 * answer.size() + piece);
    }
    const ssize_t got = ::read(child.answer, answer.data() + size, answer.size() - size);
    if (got > 0) {
      size += static_cast<std::size_t>(got);
    } else if (got == 0 || errno != EINTR) {
      break;
    }
  }
  answer.resize(size);
  return answer;
}

void forked_write(int descriptor, const void* data, std::size_t bytes) {
  const char* rest = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t written = ::write(descriptor, rest, bytes);
    if (written > 0) {
      rest += written;
      bytes -= static_cast<std::size_t>(written);
    } else if (errno != EINTR) {
      ::_exit(1);
    }
  }
}

}  // namespace palpate
