// No command writes over a file that it reads, or twice to one file, whatever the file is called.

#include <sys/stat.h>

#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::overwriting_test {

using Arguments = std::vector<std::string>;

// Four presses, at full speed.
constexpr const char* presses = "simulate:A,rate=100,seed=3,touches=1,speed=max";

class Overwriting : public ProgramTest {
 protected:
  Overwriting() {
    write_recording(folder_ / "A.h5", sample_training("A", 12));
    write_recording(folder_ / "u.h5", sample_unknown("A", {}, 2));
    std::filesystem::create_directory(folder_ / "maps");
    write_map(folder_ / "maps/A.map.h5", sample_map("A"));
    write_map(folder_ / "maps/E.map.h5", sample_map("E"));
    put_bytes(folder_ / "square.txt", "-5 -5\n5 -5\n5 5\n-5 5\n");
    put_bytes(folder_ / "scene.yaml", "objects: [{map: maps/A.map.h5}]\narray: elements.txt\n");
    std::string elements;
    for (const glm::dvec2& element : digitacts_array()) {
      elements += std::to_string(element.x) + " " + std::to_string(element.y) + "\n";
    }
    put_bytes(folder_ / "elements.txt", elements);
    put_bytes(folder_ / "poses.jsonl",
              "{\"time\": 1, \"x_mm\": 0, \"y_mm\": 0, \"theta_rad\": 0}\n");
  }

  /// The file itself by every kind of name: links of both kinds, its own, a longer one and a
  /// linked folder.
  Arguments names_of(const std::string& file) const {
    const std::filesystem::path path = folder_ / file;
    const auto make = [](const std::filesystem::path& target, const auto& name, auto link) {
      if (!std::filesystem::exists(name)) {
        link(target, name);
      }
    };
    make(path, folder_ / "link",
         [](auto& to, auto& name) { std::filesystem::create_symlink(to, name); });
    make(path, folder_ / "hard",
         [](auto& to, auto& name) { std::filesystem::create_hard_link(to, name); });
    make(path.parent_path(), folder_ / "folder",
         [](auto& to, auto& name) { std::filesystem::create_directory_symlink(to, name); });
    return {"hard", "link", file, "./maps/../" + file, "folder/" + path.filename().string()};
  }

  /// Expects the command to be refused for names of the file that follow `flag`, in a line that
  /// names both flags. To compare by names misses the first; the others are for one file of many.
  void expect_kept(const std::string& file, const std::string& flag, const std::string& other,
                   const Arguments& command, std::size_t names = 5) const {
    Arguments by = names_of(file);
    by.resize(names);
    for (const std::string& name : by) {
      Arguments arguments = command;
      arguments.insert(arguments.end(), {flag, name});
      expect_refused(arguments, {flag + " " + name, other + " reads", "overwrite", "choose"});
    }
    for (const char* name : {"link", "hard", "folder"}) {
      std::filesystem::remove(folder_ / name);
    }
  }
};

TEST_F(Overwriting, SimulateKeepsTheShape) {
  expect_kept("square.txt", "-o", "SHAPE", {"simulate", "square.txt"});
}

TEST_F(Overwriting, AFileNamedAsALetterIsNoShape) {
  put_bytes(folder_ / "A", "an older recording");
  done({"simulate", "A", "-o", "A"});
  done({"record", "--sensor", presses, "-o", "A"});
}

TEST_F(Overwriting, MapKeepsTheRecordings) {
  expect_kept("A.h5", "-o", "RECORDING", {"map", "A.h5"});
  expect_kept("A.h5", "--png", "RECORDING", {"map", "A.h5", "-o", "new.h5"});
  std::filesystem::create_directory(folder_ / "other");
  std::filesystem::create_hard_link(folder_ / "A.h5", folder_ / "other/A.map.h5");
  expect_refused({"map", "A.h5", "-o", "other/"}, {"-o other/A.map.h5", "RECORDING", "overwrite"});
  std::filesystem::create_symlink(folder_ / "A.h5", folder_ / "other/A.pgm");
  expect_refused({"map", "A.h5", "-o", "new.h5", "--ros", "other"},
                 {"--ros other/A.pgm", "RECORDING", "overwrite"});
}

TEST_F(Overwriting, MapWritesEveryFileOnce) {
  expect_refused({"map", "A.h5", "-o", "new", "--png", "./new"}, {"--png ./new", "-o writes"});
  expect_refused({"map", "A.h5", "-o", "new/", "--png", "new/A.map.h5"},
                 {"--png new/A.map.h5", "-o writes"});
  expect_refused({"map", "A.h5", "-o", "A.yaml", "--ros", "."}, {"--ros ./A.yaml", "-o writes"});
  put_bytes(folder_ / "a.png", "older");
  std::filesystem::create_hard_link(folder_ / "a.png", folder_ / "b.png");
  expect_refused({"map", "A.h5", "-o", "a.png", "--png", "b.png"}, {"--png b.png", "-o writes"});
}

TEST_F(Overwriting, RecognizeKeepsAllThatItReads) {
  const Arguments maps{"recognize", "u.h5", "--maps", "maps"};
  const Arguments scene{"recognize", "u.h5", "--scene", "scene.yaml"};
  expect_kept("u.h5", "--json", "RECORDING", maps);
  expect_kept("u.h5", "--posterior", "RECORDING", maps, 1);
  for (const char* flag : {"--json", "--posterior"}) {
    expect_kept("maps/E.map.h5", flag, "--maps", maps, 1);
    expect_kept("scene.yaml", flag, "--scene", scene, 1);
    expect_kept("maps/A.map.h5", flag, "--scene", scene, 1);
    expect_kept("elements.txt", flag, "--scene", scene, 1);
  }
}

TEST_F(Overwriting, SheetsKeepWhatTheyAreOf) {
  std::filesystem::create_directory(folder_ / "d");
  std::filesystem::copy(folder_ / "u.h5", folder_ / "d/a.png");
  const Arguments command{"recognize", "d/a.png", "--maps", "maps", "--png", "d"};
  expect_refused(command, {"--png d/a.png", "RECORDING reads", "overwrite"});
  std::filesystem::create_directory_symlink(folder_ / "d", folder_ / "link");
  expect_refused({"recognize", "d/a.png", "--maps", "maps", "--png", "link"},
                 {"--png link/a.png", "d/a.png", "RECORDING reads"});
  std::filesystem::rename(folder_ / "maps/E.map.h5", folder_ / "d/u.1.png");
  expect_refused({"recognize", "u.h5", "--maps", "maps", "d/u.1.png", "--each-frame", "--png", "d"},
                 {"--png d/u.1.png", "--maps reads"});
  // Another folder will do.
  done({"recognize", "d/a.png", "--maps", "maps", "--bins", "5x5x4", "--png", "new"});
}

TEST_F(Overwriting, RecognizeWritesEveryFileOnce) {
  const Arguments command{"recognize", "u.h5", "--maps", "maps"};
  const auto with = [&](Arguments more) {
    more.insert(more.begin(), command.begin(), command.end());
    return more;
  };
  expect_refused(with({"--json", "x", "--posterior", "./x"}), {"--json x", "--posterior writes"});
  expect_refused(with({"--json", "./d/u.png", "--png", "d"}), {"--png d/u.png", "--json writes"});
  put_bytes(folder_ / "x", "older");
  std::filesystem::create_symlink("x", folder_ / "y");
  expect_refused(with({"--json", "y", "--posterior", "x"}), {"--json y", "--posterior writes"});
}

TEST_F(Overwriting, RecordKeepsTheReplayAndThePoses) {
  done({"record", "--sensor", presses, "-o", "cc.h5"});
  expect_kept("cc.h5", "-o", "--sensor", {"record", "--sensor", "replay:cc.h5,speed=max"});
  expect_kept("square.txt", "-o", "--sensor",
              {"record", "--sensor", "simulate:square.txt,touches=1,speed=max"});
  expect_kept("poses.jsonl", "-o", "--poses",
              {"record", "--sensor", presses, "--poses", "poses.jsonl"});
}

// "-" is a stream for --json and --poses alone, and a file of that name for all others.
TEST_F(Overwriting, AFileCalledDashIsKept) {
  done({"record", "--sensor", presses, "-o", "-"});
  ASSERT_TRUE(std::filesystem::is_regular_file(folder_ / "-"));
  for (const char* name : {"-", "./-"}) {
    expect_refused({"touches", "-", "-o", name}, {"FRAMES reads", "overwrite"});
    expect_refused({"record", "--sensor", "replay:-,speed=max", "-o", name},
                   {"--sensor reads", "overwrite"});
  }
  std::filesystem::copy(folder_ / "u.h5", folder_ / "-",
                        std::filesystem::copy_options::overwrite_existing);
  expect_refused({"recognize", "-", "--maps", "maps", "--posterior", "-"},
                 {"--posterior -", "RECORDING reads"});
  expect_refused({"recognize", "-", "--maps", "maps", "--json", "./-"},
                 {"--json ./-", "RECORDING reads"});
  done({"recognize", "-", "--maps", "maps", "--bins", "5x5x4", "--json", "-"});
}

TEST_F(Overwriting, RecordKeepsTheProfile) {
  put_bytes(folder_ / "board.yaml", "name: A board\n");
  expect_kept("board.yaml", "-o", "--sensor", {"record", "--sensor", "board.yaml:serial 7"});
}

TEST_F(Overwriting, TouchesKeepsTheFrames) {
  done({"record", "--sensor", presses, "-o", "cc.h5"});
  expect_kept("cc.h5", "-o", "FRAMES", {"touches", "cc.h5"});
}

TEST_F(Overwriting, LiveKeepsAllThatItReads) {
  done({"record", "--sensor", presses, "-o", "cc,1.h5"});
  const Arguments maps{"live", "--sensor", "replay:cc,1.h5,speed=max", "--maps", "maps"};
  const Arguments scene{"live", "--sensor", presses, "--scene", "scene.yaml"};
  expect_kept("cc,1.h5", "--json", "--sensor", maps);
  expect_kept("maps/E.map.h5", "--json", "--maps", maps, 1);
  expect_kept("scene.yaml", "--json", "--scene", scene, 1);
  expect_kept("maps/A.map.h5", "--json", "--scene", scene, 1);
  expect_kept("elements.txt", "--json", "--scene", scene, 1);
  Arguments posed = maps;
  posed.insert(posed.end(), {"--poses", "poses.jsonl"});
  expect_kept("poses.jsonl", "--json", "--poses", posed, 1);
}

// As `cat` refuses to append a file to itself.
TEST_F(Overwriting, StandardInputAndOutputAreFilesToo) {
  const Outcome outcome =
      palpate({"record", "--sensor", presses, "--poses", "-", "-o", "poses.jsonl"},
              {.standard_input = folder_ / "poses.jsonl"});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("-o poses.jsonl: would overwrite -, which --poses reads"),
            std::string::npos)
      << outcome.err;
  put_bytes(folder_ / "out", "");
  const Outcome printed =
      palpate({"recognize", "u.h5", "--maps", "maps", "--json", "-", "--posterior", "out"},
              {.standard_output = folder_ / "out"});
  EXPECT_EQ(printed.status, 2);
  EXPECT_NE(printed.err.find("--json -: would overwrite out, which --posterior writes"),
            std::string::npos)
      << printed.err;
}

// Nothing is lost in a device; a FIFO would feed the command its own output.
TEST_F(Overwriting, DevicesMayBeReadAndWritten) {
  const Outcome outcome = palpate({"live", "--sensor", presses, "--maps", "maps", "--bins", "5x5x4",
                                   "--poses", "/dev/null", "--json", "/dev/null"});
  EXPECT_EQ(outcome.err.find("overwrite"), std::string::npos) << outcome.err;
  ASSERT_EQ(::mkfifo((folder_ / "fifo").c_str(), 0600), 0);
  expect_refused(
      {"live", "--sensor", presses, "--maps", "maps", "--poses", "fifo", "--json", "./fifo"},
      {"--json ./fifo", "--poses reads"});
}

}  // namespace palpate::overwriting_test
