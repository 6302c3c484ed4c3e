#pragma once

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace palpate {

/// How a process of its own ends that does this work: with 0 where no expectation has failed. What
/// the work has open is not closed, as after a kill.
template <class Work>
int status_of(const Work& work) {
  const pid_t pid = ::fork();
  if (pid == 0) {
    try {
      work();
    } catch (...) {
      ::_exit(2);
    }
    ::_exit(testing::Test::HasFailure() ? 1 : 0);
  }
  int status = -1;
  ::waitpid(pid, &status, 0);
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
