#include "support/program.hpp"

#include <fcntl.h>
#include <linux/capability.h>

#include <algorithm>
#include <cerrno>
#include <iterator>
#include <sstream>
#include <string_view>
#include <system_error>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "support/child_process.hpp"

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

/// In a forked child: becomes the program, in the folder.
[[noreturn]] void become_program(const std::filesystem::path& folder,
                                 const std::vector<std::string>& arguments) {
  if (::chdir(folder.c_str()) != 0) {
    ::_exit(126);
  }
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

}  // namespace

CommandLine::CommandLine(const std::string& text) {
  std::istringstream words(text);
  std::copy(std::istream_iterator<std::string>(words), {}, std::back_inserter(arguments_));
}

std::string CommandLine::text() const { return fmt::format("{}", fmt::join(arguments_, " ")); }

const char* program() { return PALPATE_PROGRAM; }

Outcome run_program(const std::filesystem::path& folder, const std::vector<std::string>& arguments,
                    const Surroundings& surroundings) {
  const ScratchFolder captured;
  const std::filesystem::path out = captured / "out";
  const std::filesystem::path err = captured / "err";
  const pid_t pid = ::fork();
  if (pid < 0) {
    throw std::system_error(errno, std::generic_category(), "fork");
  }
  if (pid == 0) {
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
      // Ignored, so that a write beyond the limit fails like one to a full disk.
      std::signal(SIGXFSZ, SIG_IGN);
      limit_process(RLIMIT_FSIZE, *surroundings.largest_file_bytes);
    }
    if (surroundings.memory_bytes) {
      limit_process(RLIMIT_DATA, *surroundings.memory_bytes);
    }
    if (surroundings.obeys_permissions) {
      ::prctl(PR_CAPBSET_DROP, CAP_DAC_OVERRIDE);  // of anybody but root: not permitted, nor needed
    }
    become_program(folder, arguments);
  }
  int status = 0;
  ::waitpid(pid, &status, 0);
  Outcome outcome{.status = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status),
                  .out = bytes_of(out),
                  .err = bytes_of(err)};
  // Where the machine is busy, `live` sees a sensor of any speed at its tare, and says so.
  const std::string_view tares = "palpate: taring: do not touch the array\n";
  if (outcome.err.starts_with(tares)) {
    outcome.err.erase(0, tares.size());
  }
  return outcome;
}

std::map<std::string, std::string> content_of(const std::filesystem::path& folder) {
  std::map<std::string, std::string> content;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    content[entry.path().lexically_relative(folder).string()] =
        entry.is_regular_file() ? bytes_of(entry.path()) : "";
  }
  return content;
}

std::string ProgramTest::done(const CommandLine& command) const {
  const Outcome outcome = palpate(command);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
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

void ProgramTest::expect_failed(int status, const CommandLine& command,
                                const std::vector<std::string>& named,
                                const Surroundings& surroundings) const {
  const auto before = content_of(folder_.path());
  const Outcome outcome = palpate(command, surroundings);
  SCOPED_TRACE("palpate " + command.text());
  EXPECT_EQ(outcome.status, status) << outcome.err;
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
