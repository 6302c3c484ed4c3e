#pragma once

#include <sys/wait.h>

#include <chrono>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate {

// At full speed, so that a test of seconds of touching takes none.
inline constexpr const char* unknown_e =
    "simulate:E,rate=100,seed=3,object=random,touches=4,speed=max";

/// Runs `palpate live` with maps of A and E.
class LiveTest : public ProgramTest {
 protected:
  LiveTest() {
    write_map(folder_ / "A.map.h5", sample_map("A"));
    write_map(folder_ / "E.map.h5", sample_map("E"));
  }

  static std::vector<std::string> live(const std::string& sensor,
                                       const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{"live",     "--sensor", sensor,   "--maps",
                                       "A.map.h5", "E.map.h5", "--bins", "20x20x24"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  /// Every line of JSON.
  static std::vector<nlohmann::json> parsed(const std::string& lines) {
    std::vector<nlohmann::json> records;
    std::istringstream stream(lines);
    for (std::string line; std::getline(stream, line);) {
      records.push_back(nlohmann::json::parse(line));
    }
    return records;
  }

  /// The program while it recognises, once its table has begun.
  pid_t start(const std::vector<std::string>& arguments) const {
    const pid_t pid = ProgramTest::start(arguments);
    while (bytes_of(folder_ / "said").find("latency ms") == std::string::npos) {
      if (::waitpid(pid, nullptr, WNOHANG) != 0) {
        ADD_FAILURE() << "it has ended: " << bytes_of(folder_ / "complained");
        return -1;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return pid;
  }

  std::vector<nlohmann::json> records_of(const std::string& sensor,
                                         std::vector<std::string> more = {}) const {
    more.insert(more.end(), {"--json", "live.jsonl"});
    done(live(sensor, more));
    return parsed(bytes_of(folder_ / "live.jsonl"));
  }
};

}  // namespace palpate
