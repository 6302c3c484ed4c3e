#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate {

using Arguments = std::vector<std::string>;

// Three frames of two elements, 2 mm apart.
inline const std::string frames = "time,p0,p1\n0,1,2\n0.05,3,4\n0.1,5,6\n";
inline const std::string poses = "time,x_mm,y_mm,theta_rad\n0,0,5,-1\n0.1,10,7,1\n";

/// Imports log.csv, a table of pressures, with poses.csv beside it.
class ImportCommand : public ProgramTest {
 protected:
  ImportCommand() {
    put("log.csv", frames);
    put("poses.csv", poses);
  }

  void put(const std::string& name, const std::string& text) const {
    put_bytes(folder_ / name, text);
  }

  static Arguments command(const Arguments& more) {
    Arguments arguments{"import", "log.csv"};
    for (const auto& [flag, value] : {std::pair{"--array", "2:1:2"}, {"-o", "o.h5"}}) {
      if (std::ranges::find(more, flag) == more.end()) {
        arguments.insert(arguments.end(), {flag, value});
      }
    }
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  Recording imported(const Arguments& more = {}) const {
    done(command(more));
    return read_recording(folder_ / "o.h5");
  }

  // Refused with exactly this line.
  void expect_said(const Arguments& more, const std::string& line) const {
    expect_refused(command(more), {"palpate: " + line + "\n"});
  }
};

}  // namespace palpate
