// Whatever is wrong with the input is said in one line that names it and a remedy, and leaves no
// trace. Every case starts from files with which the same commands succeed. Which contents of files
// are refused is tested where they are read.

#include "io/file_parts.hpp"
#include "letter_files.hpp"
#include "support/limits.hpp"

namespace palpate::bad_input_test {

/// Commands that succeed.
const std::string recognize = "recognize u.h5 --maps maps/A.map.h5";
const std::string map = "map A.h5 -o out.map.h5";

class BadInput : public LetterFiles {
 protected:
  /// Expects that map and recognize refuse the recording.
  void expect_no_touches(const Recording& recording, const std::vector<std::string>& named) const {
    write_recording(folder_ / "r.h5", recording);
    expect_refused("map r.h5 -o new/ --png new.png", named);
    expect_refused("recognize r.h5 --maps maps --json r.json", named);
  }
};

TEST_F(BadInput, RecordingsThatCannotBeRead) {
  std::filesystem::copy(folder_ / "A.h5", folder_ / "bad.h5");
  std::filesystem::resize_file(folder_ / "bad.h5", 4000);
  for (const char* command :
       {"map A.h5 bad.h5 -o out/ --png out.png", "info bad.h5",
        "recognize bad.h5 --maps maps --json r.json --posterior p.h5 --png new"}) {
    expect_refused(command, {"bad.h5: ", "is truncated", "again"});
  }
}

TEST_F(BadInput, MapsThatCannotBeReadOrDoNotGoTogether) {
  for (const char* folder : {"mixed", "none", "empty"}) {
    std::filesystem::create_directory(folder_ / folder);
  }
  std::filesystem::copy(folder_ / "u.h5", folder_ / "none/u.h5");
  recording_parts().save(folder_ / "mixed/bad.map.h5");
  map_parts().dataset("log_odds", {2, 3}, nan).save(folder_ / "nan.map.h5");
  map_parts().attribute("prior", 0.4).save(folder_ / "prior.map.h5");
  std::filesystem::create_hard_link(folder_ / "maps/A.map.h5", folder_ / "hard.h5");
  const std::string long_name(300, 'x');
  const std::string with_a = "recognize u.h5 --json r.json --png new --maps maps/A.map.h5 ";
  expect_each_refused(
      {{with_a + "missing.map.h5", {"missing.map.h5: no such file", "check the path"}},
       {with_a + "u.h5", {"u.h5: ", "this is a recording", "give a map"}},
       {with_a + "mixed", {"mixed/bad.map.h5: ", "this is a recording"}},
       {with_a + "none", {"none: a folder without maps", "build some"}},
       {with_a + "empty", {"empty: a folder without maps"}},
       {with_a + "nan.map.h5", {"nan.map.h5: ", "'log_odds'[0, 0] = nan", "give finite"}},
       {with_a + "prior.map.h5",
        {"prior.map.h5: ", "prior 0.4 differs", "no touches", "A.map.h5", "--prior"}},
       {with_a + "maps/../maps/A.map.h5", {"A.map.h5: ", "twice", "leave one out"}},
       {with_a + "hard.h5", {"hard.h5: ", "twice"}},
       {with_a + long_name, {long_name}}});
}

TEST_F(BadInput, TheSameRecordingTwice) {
  std::filesystem::create_hard_link(folder_ / "A.h5", folder_ / "hard.h5");
  expect_refused("recognize u.h5 ./u.h5 --maps maps", {"u.h5", "twice", "leave one out"});
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
                 {"--posterior p.h5", "not 6", "select one"});
  std::filesystem::create_directory(folder_ / "other");
  std::filesystem::copy(folder_ / "u.h5", folder_ / "other/u.h5");
  expect_refused("recognize u.h5 other/u.h5 --maps maps --png new",
                 {"other/u.h5", "same name", "rename"});
}

TEST_F(BadInput, OutputsThatCannotBeWritten) {
  std::filesystem::create_directories(folder_ / "sheets/u.1.png");
  expect_each_refused(
      {{"simulate A -o nowhere/out.h5", {"nowhere", "does not exist", "create it"}},
       {map + " --png sheets", {"sheets", "is a folder", "give the name of a file"}},
       {"map A.h5 -o u.h5/", {"u.h5", "folder"}},
       {recognize + " --posterior nowhere/p.h5 --json r.json", {"nowhere", "does not exist"}},
       {recognize + " --png u.h5", {"u.h5", "folder", "choose another"}},
       {recognize + " --each-frame --json r.json --png sheets",
        {"sheets/u.1.png", "is a folder"}}});
  const std::string long_name(300, 'x');
  expect_refused("info " + long_name, {long_name});
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
  expect_each_refused(
      {{"", {"subcommand is required", "--help"}},
       {"frobnicate u.h5", {"'frobnicate' is no command or flag; see palpate --help\n"}},
       {"--frobnicate", {"'--frobnicate'", "--help"}},
       {"simulate A", {"--output is required", "palpate simulate --help"}},
       {"simulate -o out.h5", {"SHAPE is required"}},
       {"map -o out.map.h5", {"RECORDING is required", "palpate map --help"}},
       {"recognize --maps maps", {"RECORDING is required"}},
       {"recognize u.h5", {"--maps: missing", "--scene"}},
       {"info", {"FILE is required"}},
       {"map --spread", {"'--spread' is no flag of palpate map; see palpate map --help\n"}}});
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
