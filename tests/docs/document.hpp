#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "support/program.hpp"

namespace palpate {

/// What the commands of a page print.
struct Said {
  std::string out;
  std::string err;
};

/// Runs the shell commands of a page of docs/ in a folder of the test's own.
class DocumentTest : public ProgramTest {
 protected:
  /// Runs all blocks ```sh of a page, in their order, as one script that any failure ends. A
  /// failure fails the test, and so does a line of a block without a language that the last block
  /// of commands above it has not printed. `page` is relative to docs/.
  Said run(const std::string& page) const;
  /// The array or object of a JSON file that the commands have written.
  nlohmann::json json(const std::string& file) const;
  /// What `palpate evaluate` says about results.
  nlohmann::json scores(const std::string& results) const;
  /// Expects these files.
  void expect_written(const std::vector<std::string>& names) const;
};

/// The text of a file of the source tree.
std::string source_text(const std::string& path);

}  // namespace palpate
