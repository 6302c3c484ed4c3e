#pragma once

#include <filesystem>

#include <gmock/gmock.h>

#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate {

/// Recognises an unknown among two maps, by bounds or by what else the flags ask for.
class BoundedFilter : public ProgramTest {
 protected:
  BoundedFilter() {
    std::filesystem::create_directory(folder_ / "maps");
    write_map(folder_ / "maps/A.map.h5", sample_map("A"));
    write_map(folder_ / "maps/I.map.h5", sample_map("I"));
    write_recording(folder_ / "u.h5", sample_unknown("A", {{2.0, -3.0}, 1.0}, 6));
  }

  static std::vector<std::string> with(std::vector<std::string> flags) {
    flags.insert(flags.begin(), {"u.h5", "--maps", "maps", "--bins=12x12x16"});
    return flags;
  }
  /// The record of u.h5 on a small lattice.
  nlohmann::json u(const std::vector<std::string>& flags) const { return record(with(flags)); }
  nlohmann::json bounded(std::vector<std::string> flags = {}) const {
    flags.insert(flags.end(), {"--filter", "bounded"});
    return u(flags);
  }
  void refused(std::vector<std::string> flags, const std::vector<std::string>& named) const {
    flags = with(flags);
    flags.insert(flags.begin(), "recognize");
    expect_refused(flags, named);
  }
  void scene(const std::string& yaml) const { put_bytes(folder_ / "scene.yaml", yaml); }
  /// What --verbose says of u.h5.
  std::string engine(std::vector<std::string> flags) const {
    flags.insert(flags.begin(), {"recognize", "u.h5", "--maps", "maps", "--verbose"});
    const Outcome outcome = palpate(flags);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return outcome.err;
  }
};

}  // namespace palpate
