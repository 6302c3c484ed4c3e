#pragma once

#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

namespace palpate {

/// Starts `work` in a child process, which does not outlive this one; returns its id, -1 where
/// there is none. It exits with 0 where no expectation failed. What the work has open is not
/// closed, as after a kill.
template <class Work>
pid_t start_child(const Work& work) {
  const pid_t pid = ::fork();
  if (pid == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    try {
      work();
    } catch (...) {
      ::_exit(2);
    }
    ::_exit(testing::Test::HasFailure() ? 1 : 0);
  }
  return pid;
}

/// Runs `work` in a child process; returns its wait status, 0 where no expectation failed.
template <class Work>
int status_of(const Work& work) {
  const pid_t pid = start_child(work);
  int status = -1;
  if (pid > 0) {
    ::waitpid(pid, &status, 0);
  }
  return status;
}

/// Limits what this process may hold or write, for good.
inline void limit_process(decltype(RLIMIT_DATA) resource, rlim_t most) {
  rlimit limit{};
  ::getrlimit(resource, &limit);
  limit.rlim_cur = most;
  ::setrlimit(resource, &limit);
}

}  // namespace palpate
