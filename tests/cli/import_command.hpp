#pragma once

#include <string>

#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate {

// Three frames of two elements, 2 mm apart.
inline const std::string frames = "time,p0,p1\n0,1,2\n0.05,3,4\n0.1,5,6\n";
inline const std::string poses = "time,x_mm,y_mm,theta_rad\n0,0,5,-1\n0.1,10,7,1\n";

/// Imports log.csv, a table of pressures, with poses.csv beside it, to o.h5.
class ImportCommand : public ProgramTest {
 protected:
  ImportCommand() {
    put("log.csv", frames);
    put("poses.csv", poses);
  }

  void put(const std::string& name, const std::string& text) const {
    put_bytes(folder_ / name, text);
  }
  /// The command with these flags, and an array of two elements unless they have one.
  static std::string command(const std::string& flags = "") {
    const bool has_array = flags.find("--array") != flags.npos;
    return "import log.csv -o o.h5 " + std::string(has_array ? "" : "--array 2:1:2 ") + flags;
  }
  std::string said(const std::string& flags) const { return done(command(flags)); }
  /// What a run says on standard error.
  std::string warned(const std::string& flags) const { return remarks(command(flags)); }
  Recording imported(const std::string& flags = "") const {
    said(flags);
    return read_recording(folder_ / "o.h5");
  }
};

}  // namespace palpate
