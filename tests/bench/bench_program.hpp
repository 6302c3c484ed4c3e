#pragma once

#include <sys/wait.h>

#include <cstdlib>
#include <string>

namespace palpate {

/// Exit status of palpate-bench with these arguments, which a shell expands, after settings of
/// environment variables such as "PATH=/bin ".
inline int run_bench(const std::string& arguments, const std::string& environment = "") {
  const int status =
      std::system((environment + "'" PALPATE_BENCH "' " + arguments + " >/dev/null").c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace palpate
