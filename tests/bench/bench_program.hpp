#pragma once

#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "io/scratch_folder.hpp"

namespace palpate {

/// Exit status of palpate-bench with these arguments, which a shell expands, after settings of
/// environment variables such as "PATH=/bin ".
inline int run_bench(const std::string& arguments, const std::string& environment = "") {
  const int status =
      std::system((environment + "'" PALPATE_BENCH "' " + arguments + " >/dev/null").c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// Expects that no file of the folder may be the run's --json as well, and that this is said before
/// a device is opened.
inline void expect_no_file_written_twice(const std::string& arguments,
                                         const std::filesystem::path& folder) {
  const ScratchFolder scratch;
  const std::string messages = (scratch / "messages").string();
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    SCOPED_TRACE(entry.path().string());
    const std::string before = bytes_of(entry.path());
    EXPECT_EQ(run_bench(arguments + " --device nowhere --json " + entry.path().string() + " 2>" +
                        messages),
              2);
    EXPECT_NE(bytes_of(messages).find("overwrite"), std::string::npos) << bytes_of(messages);
    EXPECT_EQ(bytes_of(entry.path()), before);
    ++files;
  }
  EXPECT_GT(files, 0);
}

}  // namespace palpate
