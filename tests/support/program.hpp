#pragma once

#include <sys/resource.h>

#include <filesystem>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "support/scratch_folder.hpp"
#include "support/variable.hpp"

namespace palpate {

/// How a run of the program ended, and what it said.
struct Outcome {
  int status = -1;  ///< exit status, or minus the signal that ended it
  std::string out;
  std::string err;
};

/// What a run may find different from an ordinary shell.
struct Surroundings {
  std::optional<rlim_t> largest_file_bytes;  ///< writes beyond it fail, as on a full disk
  std::optional<rlim_t> memory_bytes;        ///< of data that it may hold, as on a small machine
  std::filesystem::path standard_output;     ///< a file in the place of Outcome::out
  std::filesystem::path standard_error;      ///< a file in the place of Outcome::err
  std::filesystem::path standard_input;      ///< a file in the place of the test's own
  bool obeys_permissions = false;            ///< even where the test runs as root
  std::vector<int> closed;                   ///< standard streams that are closed, as a daemon's
};

/// The program's arguments: a list, or a text of them with a space between each two.
class CommandLine {
 public:
  CommandLine(std::initializer_list<std::string> arguments) : arguments_(arguments) {}
  CommandLine(std::vector<std::string> arguments) : arguments_(std::move(arguments)) {}
  CommandLine(const std::string& text);
  CommandLine(const char* text) : CommandLine(std::string(text)) {}

  const std::vector<std::string>& arguments() const& { return arguments_; }
  std::vector<std::string> arguments() && { return std::move(arguments_); }
  std::string text() const;

 private:
  std::vector<std::string> arguments_;
};

/// The file of the palpate program.
const char* program();

/// Runs the palpate program in `folder`, on which its relative paths depend.
Outcome run_program(const std::filesystem::path& folder, const std::vector<std::string>& arguments,
                    const Surroundings& surroundings = {});

/// Every file and folder below `folder`, with the files' content.
std::map<std::string, std::string> content_of(const std::filesystem::path& folder);

/// Runs the program in a folder of the test's own.
class ProgramTest : public testing::Test {
 protected:
  Outcome palpate(const CommandLine& command, const Surroundings& surroundings = {}) const {
    return run_program(folder_.path(), command.arguments(), surroundings);
  }
  /// Standard output of a run that has to go well and say nothing else.
  std::string done(const CommandLine& command) const;
  /// Standard error of a run that has to go well.
  std::string remarks(const CommandLine& command) const;
  /// The records of `recognize` with these arguments, as `--json -` prints them.
  nlohmann::json records(const CommandLine& flags) const;
  /// The one record of `recognize` with these arguments.
  nlohmann::json record(const CommandLine& flags) const;
  /// Expects this status, one line on standard error that holds every one of `named`, nothing on
  /// standard output, and the folder as it was before.
  void expect_failed(int status, const CommandLine& command, const std::vector<std::string>& named,
                     const Surroundings& surroundings = {}) const;
  /// The same of status 2.
  void expect_refused(const CommandLine& command, const std::vector<std::string>& named) const {
    expect_failed(2, command, named);
  }
  /// The same of each of these commands.
  void expect_each_refused(
      const std::vector<std::pair<std::string, std::vector<std::string>>>& commands) const {
    for (const auto& [command, named] : commands) {
      expect_refused(command, named);
    }
  }

  ScratchFolder folder_;
};

}  // namespace palpate
