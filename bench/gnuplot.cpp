#include "gnuplot.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate::bench {

namespace {

/// Exit status of gnuplot with this file as its standard input, or what kept it from starting. A
/// file and not a pipe: a gnuplot that ends early would end a writer with SIGPIPE.
std::optional<int> status_of_gnuplot(int script, const char* argument) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, script, STDIN_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  char name[] = "gnuplot";
  char* const arguments[] = {name, const_cast<char*>(argument), nullptr};
  pid_t child = 0;
  const int refused = posix_spawnp(&child, name, &actions, nullptr, arguments, environ);
  posix_spawn_file_actions_destroy(&actions);
  if (refused != 0) {
    return {};
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace

void require_gnuplot() {
  if (status_of_gnuplot(STDIN_FILENO, "--version") != 0) {
    throw Error(Fault::system,
                "gnuplot: not found, or it does not start; install gnuplot-nox or leave out "
                "--plots");
  }
}

void run_gnuplot(const std::string& script) {
  const std::unique_ptr<std::FILE, decltype(&std::fclose)> file(std::tmpfile(), &std::fclose);
  if (!file || std::fwrite(script.data(), 1, script.size(), file.get()) != script.size() ||
      std::fflush(file.get()) != 0) {
    throw Error(Fault::system, fmt::format("gnuplot script: no temporary file can be written: {}",
                                           std::strerror(errno)));
  }
  std::rewind(file.get());
  const std::optional<int> status = status_of_gnuplot(fileno(file.get()), "-");
  if (status != 0) {
    throw Error(Fault::system, fmt::format("gnuplot: failed with status {}; its message is above",
                                           status.value_or(-1)));
  }
}

std::string gnuplot_quoted(const std::string& path) {
  std::string quoted = "'";
  for (const char c : path) {
    quoted += c;
    if (c == '\'') {
      quoted += c;
    }
  }
  return quoted + "'";
}

}  // namespace palpate::bench
