// No command writes over a file that it reads, or twice to one file, whatever the file is called;
// where the disk is full or memory ends, older files stay.

#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <sstream>

#include <fmt/format.h>

#include "cli/command_files.hpp"
#include "letter_files.hpp"
#include "recognition/batch/batch_task.hpp"
#include "support/memory_limit.hpp"

namespace palpate::overwriting_test {

class FilesOfACommand : public testing::Test {
 protected:
  FilesOfACommand() {
    std::filesystem::create_directory(folder_ / "d");
    put_bytes(folder_ / "d/file", "older");
    std::filesystem::create_symlink("d/file", folder_ / "link");
    std::filesystem::create_hard_link(folder_ / "d/file", folder_ / "hard");
    std::filesystem::create_directory_symlink("d", folder_ / "folder");
  }

  std::string refusal_of(const cli::CommandFiles& files) const {
    return input_error([&] { files.prepare(); });
  }

  ScratchFolder folder_;
};

TEST_F(FilesOfACommand, AreTheSameByLinksAndOtherPaths) {
  for (const std::string name : {"hard", "link", "d/file", "d/../d/file", "folder/file"}) {
    const std::string written = folder_ / name;
    cli::CommandFiles read;
    read.reads("FRAMES", folder_ / "d/file");
    read.writes("-o", written);
    expect_named(refusal_of(read), {("-o " + written + ": ").c_str(), "would overwrite",
                                    "d/file, which FRAMES reads; choose another name"});
    cli::CommandFiles twice;
    twice.writes("--png", folder_ / "d/file");
    twice.writes("-o", written);
    expect_named(refusal_of(twice), {"which --png writes"});
  }
  cli::CommandFiles none_yet;
  none_yet.writes("--png", folder_ / "new");
  none_yet.writes_in("-o", folder_ / "d/..", "new");
  expect_named(refusal_of(none_yet), {"-o ", "/new", "which --png writes"});
  cli::CommandFiles distinct;
  distinct.reads("FRAMES", folder_ / "d/file");
  distinct.reads("--poses", folder_ / "hard");
  distinct.reads("--array", "");
  distinct.writes("-o", folder_ / "new");
  distinct.prepare();
}

// Nothing is lost in a device; a FIFO would feed the command its own output.
TEST_F(FilesOfACommand, MayBeDevicesButNotAFifo) {
  cli::CommandFiles device;
  device.reads("--poses", "/dev/null");
  device.writes("--json", "/dev/null");
  device.require_distinct();
  ASSERT_EQ(::mkfifo((folder_ / "fifo").c_str(), 0600), 0);
  cli::CommandFiles fifo;
  fifo.reads("--poses", folder_ / "fifo");
  fifo.writes("--json", folder_ / "d/../fifo");
  expect_named(refusal_of(fifo), {"--json", "--poses reads"});
}

// Four presses, at full speed.
const std::string presses = "simulate:A,rate=100,seed=3,touches=1,speed=max";

class Overwriting : public LetterFiles {
 protected:
  Overwriting() {
    put_bytes(folder_ / "square.txt", "-5 -5\n5 -5\n5 5\n-5 5\n");
    put_bytes(folder_ / "scene.yaml", "objects: [{map: maps/A.map.h5}]\narray: elements.txt\n");
    std::string elements;
    for (const glm::dvec2& element : digitacts_array()) {
      elements += std::to_string(element.x) + " " + std::to_string(element.y) + "\n";
    }
    put_bytes(folder_ / "elements.txt", elements);
    put_bytes(folder_ / "poses.jsonl", R"({"time": 1, "x_mm": 0, "y_mm": 0, "theta_rad": 0})");
  }

  /// Expects the command to be refused for the file after `flag`, which another flag names.
  void expect_kept(const std::string& command, const std::string& flag, const std::string& file,
                   const std::string& other) const {
    expect_refused(command + " " + flag + " " + file,
                   {flag + " " + file, other, "overwrite", "choose"});
  }
};

TEST_F(Overwriting, NoCommandWritesWhatItReads) {
  done("record -o cc,1.h5 --sensor " + presses);
  put_bytes(folder_ / "board.yaml", "name: A board\n");
  const std::string maps = "recognize u.h5 --maps maps";
  const std::string scene = "recognize u.h5 --scene scene.yaml";
  const std::string live = "live --sensor replay:cc,1.h5,speed=max --maps maps";
  const std::string live_scene = "live --scene scene.yaml --sensor " + presses;
  expect_kept("simulate square.txt", "-o", "./square.txt", "SHAPE reads");
  expect_kept("map A.h5", "-o", "./A.h5", "RECORDING reads");
  expect_kept("map A.h5 -o new.h5", "--png", "A.h5", "RECORDING reads");
  expect_kept("touches cc,1.h5", "-o", "./cc,1.h5", "FRAMES reads");
  for (const char* flag : {"--json", "--posterior"}) {
    expect_kept(maps, flag, "u.h5", "RECORDING reads");
    expect_kept(maps, flag, "maps/I.map.h5", "--maps reads");
    expect_kept(scene, flag, "scene.yaml", "--scene reads");
    expect_kept(scene, flag, "maps/A.map.h5", "--scene reads");
    expect_kept(scene, flag, "elements.txt", "--scene reads");
  }
  expect_kept("record --sensor replay:cc,1.h5,speed=max", "-o", "./cc,1.h5", "--sensor reads");
  expect_kept("record --sensor simulate:square.txt,touches=1,speed=max", "-o", "square.txt",
              "--sensor reads");
  expect_kept("record --poses poses.jsonl --sensor " + presses, "-o", "poses.jsonl",
              "--poses reads");
  expect_refused({"record", "--sensor", "board.yaml:serial 7", "-o", "board.yaml"},
                 {"-o board.yaml", "--sensor reads", "overwrite"});
  expect_kept(live, "--json", "./cc,1.h5", "--sensor reads");
  expect_kept(live, "--json", "maps/I.map.h5", "--maps reads");
  expect_kept(live + " --poses poses.jsonl", "--json", "poses.jsonl", "--poses reads");
  expect_kept(live_scene, "--json", "elements.txt", "--scene reads");
}

TEST_F(Overwriting, NoCommandWritesAFileTwice) {
  expect_kept("map A.h5 -o new", "--png", "./new", "-o writes");
  expect_kept("map A.h5 -o new/", "--png", "new/A.map.h5", "-o writes");
  expect_refused("map A.h5 -o A.yaml --ros .", {"--ros ./A.yaml", "-o writes"});
  expect_refused("recognize u.h5 --maps maps --json x --posterior ./x",
                 {"--json x", "--posterior writes"});
  expect_refused("recognize u.h5 --maps maps --json ./d/u.png --png d",
                 {"--png d/u.png", "--json writes"});
}

TEST_F(Overwriting, FilesInFoldersKeepWhatIsRead) {
  std::filesystem::create_directory(folder_ / "d");
  std::filesystem::copy(folder_ / "u.h5", folder_ / "d/a.png");
  std::filesystem::create_directory_symlink("d", folder_ / "link");
  std::filesystem::copy(folder_ / "maps/I.map.h5", folder_ / "d/u.1.png");
  std::filesystem::create_hard_link(folder_ / "A.h5", folder_ / "d/A.map.h5");
  std::filesystem::create_symlink(folder_ / "A.h5", folder_ / "d/A.pgm");
  expect_refused("map A.h5 -o d/", {"-o d/A.map.h5", "RECORDING", "overwrite"});
  expect_refused("map A.h5 -o new.h5 --ros d", {"--ros d/A.pgm", "RECORDING", "overwrite"});
  expect_refused("recognize d/a.png --maps maps --png link",
                 {"--png link/a.png", "d/a.png", "RECORDING reads", "overwrite"});
  expect_refused("recognize u.h5 --maps maps d/u.1.png --each-frame --png d",
                 {"--png d/u.1.png", "--maps reads"});
  // Another folder will do, and a file that is called as a letter is no shape.
  done("recognize d/a.png --maps maps --bins 5x5x4 --png new");
  put_bytes(folder_ / "A", "an older recording");
  done("simulate A -o A");
  done("record -o A --sensor " + presses);
}

// "-" is a stream for --json and --poses alone, and a file of that name for all others.
TEST_F(Overwriting, AFileCalledDashIsKept) {
  done("record -o - --sensor " + presses);
  ASSERT_TRUE(std::filesystem::is_regular_file(folder_ / "-"));
  expect_refused("touches - -o -", {"FRAMES reads", "overwrite"});
  expect_refused("record --sensor replay:-,speed=max -o ./-", {"--sensor reads", "overwrite"});
  std::filesystem::copy(folder_ / "u.h5", folder_ / "-",
                        std::filesystem::copy_options::overwrite_existing);
  expect_kept("recognize - --maps maps", "--posterior", "-", "RECORDING reads");
  expect_kept("recognize - --maps maps", "--json", "./-", "RECORDING reads");
  done("recognize - --maps maps --bins 5x5x4 --json -");
}

// As `cat` refuses to append a file to itself.
TEST_F(Overwriting, StandardInputAndOutputAreFilesToo) {
  expect_failed(2, "record --poses - -o poses.jsonl --sensor " + presses,
                {"-o poses.jsonl: would overwrite -, which --poses reads"},
                {.standard_input = folder_ / "poses.jsonl"});
  put_bytes(folder_ / "out", "");
  expect_failed(2, "recognize u.h5 --maps maps --json - --posterior out",
                {"--json -: would overwrite out, which --posterior writes"},
                {.standard_output = folder_ / "out"});
}

using FullDisk = LetterFiles;

TEST_F(FullDisk, LeavesNoPartOfAnOutputAndAnOlderFileIntact) {
  for (const auto& [command, file] :
       {std::pair{"simulate A -o new.h5", "new.h5"},
        {"map A.h5 -o new.map.h5", "new.map.h5"},
        {"map A.h5 -o new/", "new/A.map.h5"},
        {"export A.h5 -o tables", "tables/pressures.csv"},
        {"record --sensor simulate:A,touches=100,speed=max -o frames.h5", "frames.h5"},
        {"recognize u.h5 --maps maps/A.map.h5 --trace --json r.json", "r.json"},
        {"recognize u.h5 --maps maps/A.map.h5 --posterior p.h5", "p.h5"},
        {"recognize u.h5 --maps maps/A.map.h5 --png sheets", "sheets/u.png"}}) {
    std::filesystem::create_directories((folder_ / file).parent_path());
    put_bytes(folder_ / file, "an older file");
    // Below the size of every output here, above that of a message.
    expect_failed(1, command, {file}, {.largest_file_bytes = 2048});
  }
}

TEST_F(FullDisk, LeavesJsonAndPosteriorBothOrNone) {
  const std::string recognize =
      "recognize A.h5 --maps maps/A.map.h5 --json r.json --posterior p.h5";
  // Below the size of one of them, above that of the other.
  const Surroundings small{.largest_file_bytes = 12000};
  expect_failed(1, recognize + " --bins 5x5x4 --trace", {"r.json"}, small);
  expect_failed(1, recognize + " --bins 25x25x16", {"p.h5"}, small);
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
    expect_failed(1, command, {"standard output"}, {.standard_output = "/dev/full"});
  }
  EXPECT_EQ(palpate(recognize + " --json r.json", {.standard_output = "/dev/full"}).status, 1);
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
  expect_failed(1, "import log.csv --array 100:100:1 -o o.h5",
                {"palpate: out of memory; end other programs, or use smaller files"},
                {.memory_bytes = 512 << 20});
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

TEST(BatchTask, OfTwoThatAreWrittenTheFirstStays) {
  const ScratchFolder folder;
  const std::filesystem::path file = folder / "task.ndjson";
  EXPECT_TRUE(write_batch_task(file, {.program = "a", .chunk_unknowns = 1}));
  EXPECT_FALSE(write_batch_task(file, {.program = "b", .chunk_unknowns = 1}));
  EXPECT_EQ(read_batch_task(file).program, "a");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

}  // namespace palpate::overwriting_test
