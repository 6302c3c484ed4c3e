// Whatever is wrong with the input is said in one line that names it and a remedy, and leaves no
// trace. Every case starts from files with which the same commands succeed. Which contents of files
// are refused is tested where they are read.

#include "io/file_parts.hpp"
#include "support/limits.hpp"
#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::bad_input_test {

/// Commands that succeed.
const std::string recognize = "recognize u.h5 --maps A.map.h5";
const std::string map = "map A.h5 -o out.map.h5";

class BadInput : public ProgramTest {
 protected:
  BadInput() {
    write_recording(folder_ / "A.h5", sample_training("A", 12));
    write_recording(folder_ / "I.h5", sample_training("I", 12));
    write_recording(folder_ / "u.h5", sample_unknown("A", {}, 3));
    write_map(folder_ / "A.map.h5", sample_map("A"));
  }

  /// Expects that map and recognize refuse the recording.
  void expect_no_touches(const Recording& recording, const std::vector<std::string>& named) const {
    write_recording(folder_ / "r.h5", recording);
    expect_refused("map r.h5 -o new/ --png new.png", named);
    expect_refused("recognize r.h5 --maps A.map.h5 --json r.json", named);
    std::filesystem::remove(folder_ / "r.h5");
  }
};

TEST_F(BadInput, RecordingsThatCannotBeRead) {
  std::filesystem::copy(folder_ / "A.h5", folder_ / "bad.h5");
  std::filesystem::resize_file(folder_ / "bad.h5", 4000);
  for (const char* command :
       {"map A.h5 bad.h5 -o out/ --png out.png", "info bad.h5",
        "recognize bad.h5 --maps A.map.h5 --json r.json --posterior p.h5 --png new"}) {
    expect_refused(command, {"bad.h5: ", "is truncated", "again"});
  }
}

TEST_F(BadInput, MapsThatCannotBeReadOrDoNotGoTogether) {
  for (const char* folder : {"mixed", "none"}) {
    std::filesystem::create_directory(folder_ / folder);
    std::filesystem::copy(folder_ / "u.h5", folder_ / folder / "u.h5");
  }
  recording_parts().save(folder_ / "mixed/bad.map.h5");
  std::filesystem::create_directory(folder_ / "empty");
  map_parts().dataset("log_odds", {2, 3}, nan).save(folder_ / "nan.map.h5");
  map_parts().attribute("prior", 0.4).save(folder_ / "prior.map.h5");
  std::filesystem::create_hard_link(folder_ / "A.map.h5", folder_ / "hard.h5");
  const std::string long_name(300, 'x');
  const std::pair<std::string, std::vector<std::string>> cases[] = {
      {"missing.map.h5", {"missing.map.h5: no such file", "check the path"}},
      {"u.h5", {"u.h5: ", "this is a recording", "give a map"}},
      {"mixed", {"mixed/bad.map.h5: ", "this is a recording"}},
      {"none", {"none: a folder without maps", "build some"}},
      {"empty", {"empty: a folder without maps"}},
      {"nan.map.h5", {"nan.map.h5: ", "'log_odds'[0, 0] = nan", "give finite numbers"}},
      {"prior.map.h5",
       {"prior.map.h5: ", "prior 0.4 differs", "no touches", "A.map.h5", "--prior"}},
      {"./A.map.h5", {"A.map.h5: ", "twice", "leave one out"}},
      {"hard.h5", {"hard.h5: ", "twice"}},
      {long_name, {long_name}}};
  for (const auto& [file, named] : cases) {
    expect_refused(recognize + " " + file + " --json r.json --png new", named);
  }
}

TEST_F(BadInput, TheSameRecordingTwice) {
  std::filesystem::create_hard_link(folder_ / "A.h5", folder_ / "hard.h5");
  expect_refused("recognize u.h5 ./u.h5 --maps A.map.h5", {"u.h5", "twice", "leave one out"});
  expect_refused("map A.h5 hard.h5 -o out.map.h5", {"hard.h5", "twice"});
}

TEST_F(BadInput, RecordingsWithoutTouches) {
  Recording stream = sample_training("A", 3);
  stream.rows = "frames";
  expect_no_touches(stream, {"r.h5", "rows = frames", "palpate touches"});
  Recording silent = sample_training("A", 3);
  silent.valid.assign(silent.elements(), 0);
  write_recording(folder_ / "silent.h5", silent);
  expect_refused("map silent.h5 -o new/ --png new.png", {"Contact"});
}

TEST_F(BadInput, RawPressureWithoutAThreshold) {
  Recording raw = sample_training("A", 3);
  raw.pressure_unit = "raw";
  expect_no_touches(raw, {"r.h5", "pressure_unit = raw", "give --threshold"});
  write_recording(folder_ / "raw.h5", raw);
  expect_refused("map A.h5 raw.h5 -o out.map.h5 --threshold 2",
                 {"raw.h5", "pressure_unit", "a call for each"});
}

TEST_F(BadInput, LabelsThatAreMissingOrNameNoFileOrSeveral) {
  expect_refused("map u.h5 -o out/", {"u.h5", "'object' is empty", "--label"});
  expect_refused(map + " --label a/b", {"'a/b'", "--label"});
  expect_refused({"map", "A.h5", "-o", "out.map.h5", "--label", "a\nb"}, {"--label", "printable"});
  expect_refused("map A.h5 I.h5 -o out.map.h5",
                 {"I.h5", "'I' differs from 'A'", "--output out.map.h5/", "--label"});
  done("map u.h5 -o out/ --label A");
}

TEST_F(BadInput, OutputsOfSeveralUnknownsInOneFile) {
  expect_refused(recognize + " --each-frame --posterior p.h5",
                 {"--posterior p.h5", "not 3", "select one"});
  std::filesystem::create_directory(folder_ / "other");
  std::filesystem::copy(folder_ / "u.h5", folder_ / "other/u.h5");
  expect_refused("recognize u.h5 other/u.h5 --maps A.map.h5 --png new",
                 {"other/u.h5", "same name", "rename"});
}

TEST_F(BadInput, OutputsThatCannotBeWritten) {
  std::filesystem::create_directory(folder_ / "folder");
  std::filesystem::create_directories(folder_ / "sheets/u.1.png");
  const std::vector<std::string> missing{"nowhere", "does not exist", "create it"};
  const std::vector<std::string> folder{"folder", "is a folder", "give the name of a file"};
  const std::pair<std::string, std::vector<std::string>> cases[] = {
      {"simulate A -o nowhere/out.h5", missing},
      {"map A.h5 -o nowhere/out.map.h5", missing},
      {map + " --png nowhere/out.png", missing},
      {recognize + " --json nowhere/r.json --png new", missing},
      {recognize + " --posterior nowhere/p.h5 --json r.json", missing},
      {"simulate A -o folder", folder},
      {map + " --png folder", folder},
      {recognize + " --json folder", folder},
      {recognize + " --each-frame --json r.json --png sheets", {"sheets/u.1.png", "is a folder"}},
      {"map A.h5 -o u.h5/", {"u.h5", "folder"}},
      {recognize + " --png u.h5", {"u.h5", "folder", "choose another"}}};
  for (const auto& [command, named] : cases) {
    expect_refused(command, named);
  }
}

TEST_F(BadInput, NamesThatAreLongOrOfSeveralLines) {
  const std::string long_name(300, 'x');
  expect_refused({"info", long_name}, {long_name});
  expect_refused({"info", "a\nb"}, {"a b: no such file"});
}

TEST_F(BadInput, DevicesThatAreNotThere) {
  for (const std::string device : {"99", "nosuchdevice"}) {
    const std::vector<std::string> named{"device", device, "palpate devices"};
    expect_refused("map A.h5 -o new/ --png new.png --device " + device, named);
    expect_refused(recognize + " --json r.json --png new --device " + device, named);
  }
}

TEST_F(BadInput, CommandLinesThatAreNotComplete) {
  expect_refused({}, {"subcommand is required", "--help"});
  expect_refused("frobnicate u.h5", {"'frobnicate'", "no command", "--help"});
  expect_refused("--frobnicate", {"'--frobnicate'", "--help"});
  expect_refused("simulate A", {"--output is required", "palpate simulate --help"});
  expect_refused("simulate -o out.h5", {"SHAPE is required"});
  expect_refused("map -o out.map.h5", {"RECORDING is required", "palpate map --help"});
  expect_refused("recognize --maps A.map.h5", {"RECORDING is required"});
  expect_refused("recognize u.h5", {"--maps: missing", "--scene"});
  expect_refused("info", {"FILE is required"});
  expect_refused("info u.h5 --frobnicate",
                 {"'--frobnicate' is no flag of palpate info", "see palpate info --help"});
}

TEST_F(BadInput, FlagsThatDoNotGoTogether) {
  for (const std::string flag :
       {"--particles 100", "--seed 1", "--resampling systematic", "--augmented"}) {
    expect_refused(recognize + " " + flag,
                   {flag.substr(0, flag.find(' ')), "add --filter particles"});
  }
  expect_refused(recognize + " --filter particles --posterior p.h5",
                 {"--posterior p.h5", "use --filter histogram"});
  expect_refused(recognize + " --each-frame --touches 1",
                 {"--touches", "--each-frame", "leave one"});
}

}  // namespace palpate::bad_input_test
