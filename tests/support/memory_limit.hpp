#pragma once

#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstddef>

namespace palpate {

/// Whether a process can be kept from taking memory: qemu-user, for one, takes limits and does not
/// hold them.
inline bool limits_memory() {
  const pid_t pid = ::fork();
  if (pid == 0) {
    // 1 MiB, not 0: Linux does not hold a soft limit of 0.
    rlimit limit{};
    ::getrlimit(RLIMIT_DATA, &limit);
    limit.rlim_cur = 1 << 20;
    ::setrlimit(RLIMIT_DATA, &limit);
    constexpr std::size_t bytes = std::size_t{1} << 26;
    const void* const taken =
        ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    ::_exit(taken == MAP_FAILED ? 0 : 1);
  }
  int status = -1;
  return ::waitpid(pid, &status, 0) == pid && status == 0;
}

}  // namespace palpate
