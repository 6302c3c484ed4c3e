#include "support/program.hpp"

#include <fcntl.h>
#include <linux/capability.h>
#include <poll.h>
#include <pty.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <system_error>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace palpate {

namespace {

void redirect(int descriptor, const std::filesystem::path& file) {
  const int flags = descriptor == STDIN_FILENO ? O_RDONLY : O_WRONLY | O_CREAT | O_TRUNC;
  const int opened = ::open(file.c_str(), flags, 0600);
  if (opened < 0 || ::dup2(opened, descriptor) < 0) {
    ::_exit(126);
  }
  ::close(opened);
}

/// What fork() and its like return, unless they refuse: this test fails then, with their reason.
pid_t require_process(pid_t pid, const char* call) {
  if (pid < 0) {
    throw std::system_error(errno, std::generic_category(), call);
  }
  return pid;
}

void limit_files(rlim_t bytes) {
  // Ignored, so that a write beyond the limit fails like one to a full disk.
  std::signal(SIGXFSZ, SIG_IGN);
  const rlimit limit{.rlim_cur = bytes, .rlim_max = bytes};
  ::setrlimit(RLIMIT_FSIZE, &limit);
}

}  // namespace

CommandLine::CommandLine(const std::string& text) {
  std::istringstream words(text);
  std::copy(std::istream_iterator<std::string>(words), {}, std::back_inserter(arguments_));
}

std::string CommandLine::text() const { return fmt::format("{}", fmt::join(arguments_, " ")); }

const char* program() { return PALPATE_PROGRAM; }

[[noreturn]] void become_program(const std::vector<std::string>& arguments) {
  std::string name = PALPATE_PROGRAM;
  std::vector<std::string> texts = arguments;
  std::vector<char*> argv{name.data()};
  for (std::string& text : texts) {
    argv.push_back(text.data());
  }
  argv.push_back(nullptr);
  // Far longer than any run here takes, sanitizers included: a program that hangs is ended.
  ::alarm(120);
  ::execv(name.c_str(), argv.data());
  ::_exit(127);
}

Outcome run_program(const std::filesystem::path& folder, const std::vector<std::string>& arguments,
                    const Surroundings& surroundings) {
  const ScratchFolder captured;
  const std::filesystem::path out = captured / "out";
  const std::filesystem::path err = captured / "err";
  const pid_t pid = require_process(::fork(), "fork");
  if (pid == 0) {
    if (::chdir(folder.c_str()) != 0) {
      ::_exit(126);
    }
    redirect(STDOUT_FILENO,
             surroundings.standard_output.empty() ? out : surroundings.standard_output);
    redirect(STDERR_FILENO,
             surroundings.standard_error.empty() ? err : surroundings.standard_error);
    if (!surroundings.standard_input.empty()) {
      redirect(STDIN_FILENO, surroundings.standard_input);
    }
    for (const int stream : surroundings.closed) {
      ::close(stream);
    }
    if (surroundings.largest_file_bytes) {
      limit_files(*surroundings.largest_file_bytes);
    }
    if (surroundings.memory_bytes) {
      const rlimit limit{.rlim_cur = *surroundings.memory_bytes, .rlim_max = RLIM_INFINITY};
      ::setrlimit(RLIMIT_DATA, &limit);
    }
    if (surroundings.obeys_permissions) {
      ::prctl(PR_CAPBSET_DROP, CAP_DAC_OVERRIDE);  // of anybody but root: not permitted, nor needed
    }
    become_program(arguments);
  }
  int status = 0;
  ::waitpid(pid, &status, 0);
  return {.status = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status),
          .out = bytes_of(out),
          .err = bytes_of(err)};
}

ProgramOnTerminal::ProgramOnTerminal(const std::filesystem::path& folder,
                                     const std::vector<std::string>& arguments,
                                     const std::map<std::string, std::string>& environment,
                                     int columns, int rows) {
  winsize window{};
  window.ws_col = static_cast<unsigned short>(columns);
  window.ws_row = static_cast<unsigned short>(rows);
  pid_ = require_process(::forkpty(&terminal_, nullptr, nullptr, &window), "forkpty");
  if (pid_ == 0) {
    if (::chdir(folder.c_str()) != 0) {
      ::_exit(126);
    }
    for (const auto& [name, value] : environment) {
      ::setenv(name.c_str(), value.c_str(), 1);
    }
    become_program(arguments);
  }
}

ProgramOnTerminal::~ProgramOnTerminal() {
  if (pid_ > 0) {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  if (terminal_ >= 0) {
    ::close(terminal_);
  }
}

bool ProgramOnTerminal::read_more() {
  char piece[4096];
  // The terminal ends with an error, not with an end of file, when the program is gone.
  const ssize_t got = ::read(terminal_, piece, sizeof piece);
  if (got > 0) {
    text_.append(piece, static_cast<std::size_t>(got));
  }
  return got > 0;
}

bool ProgramOnTerminal::shows(const std::string& text) {
  for (;;) {
    const std::size_t found = text_.find(text, seen_);
    if (found != text_.npos) {
      seen_ = found + text.size();
      return true;
    }
    if (!read_more()) {
      return false;
    }
  }
}

void ProgramOnTerminal::type(const std::string& keys) const {
  EXPECT_EQ(::write(terminal_, keys.data(), keys.size()), static_cast<ssize_t>(keys.size()));
}

Outcome ProgramOnTerminal::finish() {
  while (read_more()) {
  }
  int status = 0;
  ::waitpid(pid_, &status, 0);
  pid_ = -1;
  return {.status = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status),
          .out = text_,
          .err = {}};
}

std::map<std::string, std::string> content_of(const std::filesystem::path& folder) {
  std::map<std::string, std::string> content;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    content[entry.path().lexically_relative(folder).string()] =
        entry.is_regular_file() ? bytes_of(entry.path()) : "";
  }
  return content;
}

pid_t ProgramTest::start(const CommandLine& command) const {
  const pid_t pid = require_process(::fork(), "fork");
  if (pid == 0) {
    if (::chdir(folder_.path().c_str()) != 0 || std::freopen("said", "w", stdout) == nullptr ||
        std::freopen("complained", "w", stderr) == nullptr) {
      ::_exit(126);
    }
    become_program(command.arguments());
  }
  return pid;
}

void ProgramTest::kill_program(pid_t pid) {
  // The command runs in a child, which dies with the process that is killed, but is not waited for
  // by anybody here.
  std::ifstream children(fmt::format("/proc/{0}/task/{0}/children", pid));
  pid_t child = -1;
  children >> child;
  pollfd ended{.fd = child > 0 ? static_cast<int>(::syscall(SYS_pidfd_open, child, 0)) : -1,
               .events = POLLIN,
               .revents = 0};
  ::kill(pid, SIGKILL);
  ::waitpid(pid, nullptr, 0);
  ::poll(&ended, 1, ended.fd < 0 ? 0 : -1);
  ::close(ended.fd);
}

std::string ProgramTest::done(const CommandLine& command) const {
  const Outcome outcome = palpate(command);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  // Where the machine is busy, `live` sees a sensor of any speed at its tare, and says so.
  const bool tares = command.arguments().front() == "live" &&
                     outcome.err == "palpate: taring: do not touch the array\n";
  EXPECT_TRUE(outcome.err.empty() || tares) << outcome.err;
  return outcome.out;
}

std::string ProgramTest::remarks(const CommandLine& command) const {
  const Outcome outcome = palpate(command);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  return outcome.err;
}

nlohmann::json ProgramTest::records(const CommandLine& flags) const {
  std::vector<std::string> arguments = flags.arguments();
  arguments.insert(arguments.begin(), "recognize");
  arguments.insert(arguments.end(), {"--json", "-"});
  return nlohmann::json::parse(done(arguments));
}

nlohmann::json ProgramTest::record(const CommandLine& flags) const {
  const nlohmann::json all = records(flags);
  EXPECT_EQ(all.size(), 1u);
  return all.at(0);
}

void ProgramTest::expect_refused(const CommandLine& command,
                                 const std::vector<std::string>& named) const {
  const auto before = content_of(folder_.path());
  const Outcome outcome = palpate(command);
  SCOPED_TRACE("palpate " + command.text());
  EXPECT_EQ(outcome.status, 2) << outcome.err;
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  EXPECT_TRUE(outcome.err.ends_with('\n'));
  for (const std::string& part : named) {
    EXPECT_NE(outcome.err.find(part), std::string::npos)
        << "'" << part << "' not in " << outcome.err;
  }
  EXPECT_EQ(outcome.out, "");
  EXPECT_TRUE(content_of(folder_.path()) == before) << "the folder has changed";
}

}  // namespace palpate
