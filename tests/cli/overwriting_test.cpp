// No command writes over a file that it reads, or twice to one file, whatever the file is called.

#include <sys/stat.h>

#include "cli/command_files.hpp"
#include "letter_files.hpp"

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
  for (const char* file : {"scene.yaml", "maps/A.map.h5", "elements.txt"}) {
    expect_kept(live_scene, "--json", file, "--scene reads");
  }
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
  const Outcome posed = palpate("record --poses - -o poses.jsonl --sensor " + presses,
                                {.standard_input = folder_ / "poses.jsonl"});
  EXPECT_EQ(posed.status, 2);
  expect_named(posed.err, {"-o poses.jsonl: would overwrite -, which --poses reads"});
  put_bytes(folder_ / "out", "");
  const Outcome printed = palpate("recognize u.h5 --maps maps --json - --posterior out",
                                  {.standard_output = folder_ / "out"});
  EXPECT_EQ(printed.status, 2);
  expect_named(printed.err, {"--json -: would overwrite out, which --posterior writes"});
}

}  // namespace palpate::overwriting_test
