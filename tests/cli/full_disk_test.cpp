#include <algorithm>

#include <fmt/format.h>

#include "support/memory_limit.hpp"
#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::full_disk_test {

class FullDisk : public ProgramTest {
 protected:
  FullDisk() {
    write_map(folder_ / "A.map.h5", sample_map("A"));
    write_recording(folder_ / "u.h5", sample_unknown("A", {}, 6));
    write_recording(folder_ / "A.h5", sample_training("A", 48));
  }

  static void expect_failure(const Outcome& outcome, const char* named) {
    EXPECT_EQ(outcome.status, 1) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_NE(outcome.err.find(named), std::string::npos) << outcome.err;
  }
};

struct Output {
  const char* name;
  std::vector<std::string> arguments;
  const char* file;

  friend void PrintTo(const Output& output, std::ostream* out) { *out << output.file; }
};

class FullDiskOutput : public FullDisk, public testing::WithParamInterface<Output> {};

TEST_P(FullDiskOutput, LeavesNoPartAndAnOlderFileIntact) {
  const std::filesystem::path target = folder_ / GetParam().file;
  std::filesystem::create_directories(target.parent_path());
  for (const char* older : {"", "an older file"}) {
    std::filesystem::remove(target);
    if (*older != '\0') {
      put_bytes(target, older);
    }
    const auto before = content_of(folder_.path());
    // Below the size of every output here, above that of a message.
    const Outcome outcome = palpate(GetParam().arguments, {.largest_file_bytes = 2048});
    expect_failure(outcome, GetParam().file);
    EXPECT_TRUE(content_of(folder_.path()) == before) << "the folder has changed";
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, FullDiskOutput,
    testing::Values(Output{"recording", {"simulate", "A", "-o", "new.h5"}, "new.h5"},
                    Output{"map", {"map", "A.h5", "-o", "new.map.h5"}, "new.map.h5"},
                    Output{"map_in_folder", {"map", "A.h5", "-o", "maps/"}, "maps/A.map.h5"},
                    Output{
                        "json",
                        {"recognize", "u.h5", "--maps", "A.map.h5", "--trace", "--json", "r.json"},
                        "r.json"},
                    Output{"posterior",
                           {"recognize", "u.h5", "--maps", "A.map.h5", "--posterior", "p.h5"},
                           "p.h5"},
                    Output{"sheet",
                           {"recognize", "u.h5", "--maps", "A.map.h5", "--png", "sheets"},
                           "sheets/u.png"}),
    [](const auto& test) { return std::string(test.param.name); });

TEST_F(FullDisk, StandardOutputThatCannotBeWrittenIsAFailure) {
  expect_failure(palpate({"recognize", "u.h5", "--maps", "A.map.h5", "--json", "-"},
                         {.standard_output = "/dev/full"}),
                 "standard output");
}

TEST_F(FullDisk, LongOutputThatCannotBeWrittenIsAFailureOfStandardOutputToo) {
  // More than standard output keeps back until the end.
  expect_failure(palpate({"recognize", "u.h5", "--maps", "A.map.h5", "--each-frame", "--trace",
                          "--bins", "5x5x4", "--json", "-"},
                         {.standard_output = "/dev/full"}),
                 "standard output");
  expect_failure(palpate({"live", "--sensor", "simulate:A,rate=100,touches=2,speed=max", "--maps",
                          "A.map.h5", "--bins", "5x5x4"},
                         {.standard_output = "/dev/full"}),
                 "standard output");
}

TEST_F(FullDisk, HelpThatCannotBeWrittenIsAFailure) {
  for (const char* flag : {"--help", "--version"}) {
    expect_failure(palpate({flag}, {.standard_output = "/dev/full"}), "standard output");
  }
}

TEST_F(FullDisk, ResultsAreWrittenWhereNobodyListens) {
  const Outcome outcome = palpate({"recognize", "A.h5", "--maps", "A.map.h5", "--each-frame",
                                   "--trace", "--bins", "5x5x4", "--json", "r.json"},
                                  {.standard_output = "/dev/full"});
  expect_failure(outcome, "standard output");
  EXPECT_EQ(nlohmann::json::parse(bytes_of(folder_ / "r.json")).size(), 48u);
}

TEST_F(FullDisk, JsonAndPosteriorAreBothWrittenOrNone) {
  const auto before = content_of(folder_.path());
  const auto expect_none = [&](const std::string& bins, bool trace, const char* refused) {
    std::vector<std::string> arguments{"recognize", "A.h5",   "--maps", "A.map.h5",    "--bins",
                                       bins,        "--json", "r.json", "--posterior", "p.h5"};
    if (trace) {
      arguments.emplace_back("--trace");
    }
    // Below the size of one of them, above that of the other.
    expect_failure(palpate(arguments, {.largest_file_bytes = 12000}), refused);
    EXPECT_TRUE(content_of(folder_.path()) == before) << "the folder has changed";
  };
  expect_none("5x5x4", true, "r.json");
  expect_none("25x25x16", false, "p.h5");
}

TEST_F(FullDisk, StandardErrorThatCannotBeWrittenKeepsTheStatus) {
  EXPECT_EQ(palpate({"info", "missing.h5"}, {.standard_error = "/dev/full"}).status, 2);
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
  const auto before = content_of(folder_.path());
  const Outcome outcome = palpate({"import", "log.csv", "--array", "100:100:1", "-o", "o.h5"},
                                  {.memory_bytes = 512 << 20});
  expect_failure(outcome, "palpate: out of memory; end other programs, or use smaller files");
  EXPECT_TRUE(content_of(folder_.path()) == before);
}

}  // namespace palpate::full_disk_test
