#pragma once

#include <string>
#include <vector>

#include <fmt/format.h>

#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate {

/// Recordings of two letters, one of them broken, and what `palpate batch` makes of them.
class BatchTest : public ProgramTest {
 protected:
  static constexpr int recordings = 11;
  static constexpr int broken = 4;

  BatchTest() {
    std::filesystem::create_directories(folder_ / "maps");
    std::filesystem::create_directories(folder_ / "u");
    write_map(folder_ / "maps/A.map.h5", sample_map("A"));
    write_map(folder_ / "maps/E.map.h5", sample_map("E"));
    for (int i = 0; i < recordings; ++i) {
      const Pose pose{{0.5 * i - 2.0, 1.0}, 0.3 * i};
      write_recording(folder_ / name(i), sample_unknown(i % 2 == 0 ? "A" : "E", pose, 5));
    }
    put_bytes(folder_ / name(broken), "no recording");
  }

  static std::string name(int i) { return fmt::format("u/{:02}.h5", i); }

  /// palpate batch on all of u/, in chunks of 3.
  static std::vector<std::string> batch(const std::string& results,
                                        const std::vector<std::string>& more = {},
                                        const std::string& inputs = "u") {
    std::vector<std::string> arguments{"batch",    inputs,    "-o",      results,
                                       "--maps",   "maps",    "--bins",  "10x10x10",
                                       "--filter", "bounded", "--chunk", "3"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  std::string merged(const std::string& results) const {
    const Outcome outcome = palpate({"merge", results});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return outcome.out;
  }

  /// The records of a merged text, one a line.
  static std::vector<nlohmann::json> parse(const std::string& lines) {
    std::vector<nlohmann::json> all;
    for (std::size_t at = 0; at < lines.size(); at = lines.find('\n', at) + 1) {
      all.push_back(nlohmann::json::parse(lines.substr(at, lines.find('\n', at) - at)));
    }
    return all;
  }

  /// Expects the status, and one line on standard error that holds every one of `named`.
  void expect_failure(int status, const std::vector<std::string>& arguments,
                      const std::vector<std::string>& named,
                      const Surroundings& surroundings = {}) const {
    const Outcome outcome = palpate(arguments, surroundings);
    EXPECT_EQ(outcome.status, status) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    for (const std::string& part : named) {
      EXPECT_NE(outcome.err.find(part), std::string::npos)
          << "'" << part << "' not in " << outcome.err;
    }
  }

  /// The last time at which each chunk was written.
  std::map<std::string, std::filesystem::file_time_type> times(const std::string& results) const {
    std::map<std::string, std::filesystem::file_time_type> times;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / results / "chunks")) {
      times[entry.path().filename().string()] = entry.last_write_time();
    }
    return times;
  }
};

}  // namespace palpate
