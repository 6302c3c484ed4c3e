#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <sstream>

#include <fmt/format.h>

#include "letter_files.hpp"
#include "support/memory_limit.hpp"

namespace palpate::full_disk_test {

class FullDisk : public LetterFiles {
 protected:
  /// Expects status 1 and one line that names this.
  void expect_failure(const std::string& command, const Surroundings& surroundings,
                      const char* named) const {
    SCOPED_TRACE(command);
    const Outcome outcome = palpate(command, surroundings);
    EXPECT_EQ(outcome.status, 1) << outcome.err;
    EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
    expect_named(outcome.err, {named});
  }
  /// The same, and the folder as it was before, where files may grow to so many bytes.
  void expect_untouched(const std::string& command, rlim_t bytes, const char* named) const {
    const auto before = content_of(folder_.path());
    expect_failure(command, {.largest_file_bytes = bytes}, named);
    EXPECT_TRUE(content_of(folder_.path()) == before) << "the folder has changed: " << command;
  }
};

TEST_F(FullDisk, LeavesNoPartOfAnOutputAndAnOlderFileIntact) {
  for (const auto& [command, file] :
       {std::pair{"simulate A -o new.h5", "new.h5"},
        {"map A.h5 -o new.map.h5", "new.map.h5"},
        {"map A.h5 -o new/", "new/A.map.h5"},
        {"recognize u.h5 --maps maps/A.map.h5 --trace --json r.json", "r.json"},
        {"recognize u.h5 --maps maps/A.map.h5 --posterior p.h5", "p.h5"},
        {"recognize u.h5 --maps maps/A.map.h5 --png sheets", "sheets/u.png"}}) {
    std::filesystem::create_directories((folder_ / file).parent_path());
    put_bytes(folder_ / file, "an older file");
    // Below the size of every output here, above that of a message.
    expect_untouched(command, 2048, file);
  }
}

TEST_F(FullDisk, LeavesJsonAndPosteriorBothOrNone) {
  const std::string recognize =
      "recognize A.h5 --maps maps/A.map.h5 --json r.json --posterior p.h5";
  // Below the size of one of them, above that of the other.
  expect_untouched(recognize + " --bins 5x5x4 --trace", 12000, "r.json");
  expect_untouched(recognize + " --bins 25x25x16", 12000, "p.h5");
}

TEST_F(FullDisk, OfStandardOutputIsAFailureThatLeavesFiles) {
  const std::string recognize =
      "recognize A.h5 --maps maps/A.map.h5 --bins 5x5x4 --each-frame --trace";
  for (const std::string& command :
       {std::string("recognize u.h5 --maps maps/A.map.h5 --json -"),
        // More than standard output keeps back until the end.
        recognize + " --json -", std::string("--help"), std::string("--version"),
        std::string("live --sensor simulate:A,rate=100,touches=2,speed=max --maps maps/A.map.h5"
                    " --bins 5x5x4")}) {
    expect_failure(command, {.standard_output = "/dev/full"}, "standard output");
  }
  expect_failure(recognize + " --json r.json", {.standard_output = "/dev/full"}, "standard output");
  EXPECT_EQ(nlohmann::json::parse(bytes_of(folder_ / "r.json")).size(), 48u);
}

// Closed, as a daemon's are.
TEST_F(FullDisk, OrClosedStreamsKeepTheStatusAndLandInNoFile) {
  const std::vector<int> every{STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO};
  EXPECT_EQ(palpate("info missing.h5", {.standard_error = "/dev/full"}).status, 2);
  EXPECT_EQ(palpate("info missing.h5", {.closed = every}).status, 2);
  EXPECT_EQ(palpate("--version", {.closed = every}).status, 0);

  const std::string recognize = "recognize u.h5 --maps maps --bins 5x5x4 --posterior p.h5 --png s";
  EXPECT_EQ(palpate(recognize).status, 0);
  const auto expected = content_of(folder_.path());
  for (const std::vector<int>& closed :
       {std::vector{STDIN_FILENO}, {STDOUT_FILENO}, {STDERR_FILENO}, every}) {
    std::filesystem::remove(folder_ / "p.h5");
    std::filesystem::remove_all(folder_ / "s");
    EXPECT_EQ(palpate(recognize, {.closed = closed}).status, 0);
    EXPECT_TRUE(content_of(folder_.path()) == expected);
  }
  for (const std::vector<int>& closed : {std::vector{STDOUT_FILENO}, every}) {
    const Outcome live = palpate(
        "live --sensor simulate:A,rate=100,seed=3,touches=2,speed=max --maps maps"
        " --bins 5x5x4 --json f",
        {.closed = closed});
    EXPECT_EQ(live.status, 0) << live.err;
    EXPECT_EQ(live.err, "");
    std::istringstream file(bytes_of(folder_ / "f"));
    int lines = 0;
    for (std::string line; std::getline(file, line); ++lines) {
      EXPECT_TRUE(nlohmann::json::accept(line)) << line;
    }
    EXPECT_EQ(lines, 2);
  }
}

// Each of 20,000 readings has its own time, and so a frame of 10,000 elements: 1.6 GB.
TEST_F(FullDisk, AndMemoryThatEndsAreOneLine) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer takes memory of its own";
#endif
  if (!limits_memory()) {
    GTEST_SKIP() << "memory of processes is not limited here";
  }
  std::string text = "time,element,pressure\n";
  for (int i = 0; i < 20'000; ++i) {
    text += fmt::format("{},0,1\n", i);
  }
  put_bytes(folder_ / "log.csv", text);
  expect_failure("import log.csv --array 100:100:1 -o o.h5", {.memory_bytes = 512 << 20},
                 "palpate: out of memory; end other programs, or use smaller files");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "o.h5"));
}

using ImportMemory = ProgramTest;

/// The largest memory of a command so far.
long largest_kib() {
  rusage usage{};
  ::getrusage(RUSAGE_CHILDREN, &usage);
  return usage.ru_maxrss;
}

TEST_F(ImportMemory, OfLongLogsIsLittle) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer holds memory of its own";
#endif
  done("simulate A -o A.h5");
  const long before = largest_kib();
  // 200,000 frames: 7 MB of text and 6 MB of pressures.
  std::string log = "time,p0,p1,p2,p3\n";
  for (int i = 0; i < 200'000; ++i) {
    log += fmt::format("{},0.125,1.25,2.5,{}\n", i * 0.001, i % 7);
  }
  put_bytes(folder_ / "log.csv", log);
  done("import log.csv -o o.h5 --array 4:1:2");
  // The recording takes 72 bytes a row here (pressures, pose and time), and its file as much again,
  // twice; every row of text would be 40 bytes more.
  EXPECT_LT(largest_kib() - before, 64 * 1024);
  EXPECT_EQ(read_recording(folder_ / "o.h5").size(), 200'000u);
  // 2,000 readings at as many times: frames of 4,096 elements each.
  log = "time,element,pressure\n";
  for (int i = 0; i < 2000; ++i) {
    log += fmt::format("{0},{0},0.5\n", i);
  }
  put_bytes(folder_ / "log.csv", log);
  done("import log.csv -o o.h5 --array 64:64:2");
  constexpr long checked_kib = 2000 * (4096 * (8 + 1 + 4) + 88) / 1024;
  EXPECT_LT(largest_kib() - before, checked_kib);
}

}  // namespace palpate::full_disk_test
