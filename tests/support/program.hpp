#pragma once

#include <sys/resource.h>

#include <filesystem>
#include <map>
#include <optional>
#include <string>
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

/// Runs the palpate program in `folder`, on which its relative paths depend.
Outcome run_program(const std::filesystem::path& folder, const std::vector<std::string>& arguments,
                    const Surroundings& surroundings = {});

/// The palpate program on a terminal of its own.
class ProgramOnTerminal {
 public:
  /// `environment` is set on top of the test's own. Throws, and so fails the test, where the
  /// machine has no pseudo-terminal to give.
  ProgramOnTerminal(const std::filesystem::path& folder, const std::vector<std::string>& arguments,
                    const std::map<std::string, std::string>& environment = {}, int columns = 80,
                    int rows = 24);
  ~ProgramOnTerminal();
  ProgramOnTerminal(const ProgramOnTerminal&) = delete;
  ProgramOnTerminal& operator=(const ProgramOnTerminal&) = delete;

  /// Waits until the program has shown this since the last call; false if it ends before.
  bool shows(const std::string& text);
  void type(const std::string& keys) const;
  /// Waits for the end of the program: its status, and all that it has shown.
  Outcome finish();

 private:
  bool read_more();

  int terminal_ = -1;
  pid_t pid_ = -1;
  std::string text_;
  std::size_t seen_ = 0;  ///< of text_, by shows()
};

/// In a forked child: becomes the palpate program.
[[noreturn]] void become_program(const std::vector<std::string>& arguments);

/// Every file and folder below `folder`, with the files' content.
std::map<std::string, std::string> content_of(const std::filesystem::path& folder);

/// Runs the program in a folder of the test's own.
class ProgramTest : public testing::Test {
 protected:
  Outcome palpate(const std::vector<std::string>& arguments,
                  const Surroundings& surroundings = {}) const {
    return run_program(folder_.path(), arguments, surroundings);
  }
  /// Starts the program, whose output goes to the files "said" and "complained".
  pid_t start(const std::vector<std::string>& arguments) const;
  /// Kills the program with SIGKILL and waits for its end.
  static void kill_program(pid_t pid);
  /// Standard output of a run that has to go well and say nothing else.
  std::string done(const std::vector<std::string>& arguments) const;
  /// The records of `recognize` with these arguments, as `--json -` prints them.
  nlohmann::json records(std::vector<std::string> arguments) const;
  /// The one record of `recognize` with these arguments.
  nlohmann::json record(const std::vector<std::string>& arguments) const;
  /// Expects status 2, one line on standard error that holds every one of `named`, nothing on
  /// standard output, and the folder as it was before.
  void expect_refused(const std::vector<std::string>& arguments,
                      const std::vector<std::string>& named) const;

  ScratchFolder folder_;
};

}  // namespace palpate
