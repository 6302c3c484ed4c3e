// Whatever is wrong with the input is said in one line that names it and a remedy, and leaves no
// trace. Every case starts from files with which the same commands succeed.

#include <gtest/gtest.h>

#include <cmath>

#include "io/file_parts.hpp"
#include "support/limits.hpp"
#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::bad_input_test {

using Arguments = std::vector<std::string>;

const Arguments recognize{"recognize", "u.h5", "--maps", "A.map.h5"};
const Arguments map{"map", "A.h5", "-o", "out.map.h5"};
const Arguments simulate{"simulate", "A", "-o", "out.h5"};

Arguments with(Arguments command, const Arguments& more) {
  command.insert(command.end(), more.begin(), more.end());
  return command;
}

class BadInput : public ProgramTest {
 protected:
  BadInput() {
    write_recording(folder_ / "A.h5", sample_training("A", 12));
    write_recording(folder_ / "I.h5", sample_training("I", 12));
    write_recording(folder_ / "u.h5", sample_unknown("A", {}, 3));
    write_map(folder_ / "A.map.h5", sample_map("A"));
    write_map(folder_ / "I.map.h5", sample_map("I"));
  }
};

/// A file that is not what it should be, and what is said of it by every command that reads it.
struct BadFile {
  std::string name;
  std::function<void(const std::filesystem::path&)> make;
  std::vector<std::string> named;

  friend void PrintTo(const BadFile& file, std::ostream* out) { *out << file.name; }
};

class BadRecording : public BadInput, public testing::WithParamInterface<BadFile> {};

TEST_P(BadRecording, IsRefusedByEveryCommand) {
  GetParam().make(folder_ / "bad.h5");
  const std::vector<std::string> named = [] {
    std::vector<std::string> parts = GetParam().named;
    parts.push_back("bad.h5: ");
    return parts;
  }();
  expect_refused({"map", "A.h5", "bad.h5", "-o", "out/", "--png", "out.png"}, named);
  expect_refused({"recognize", "bad.h5", "--maps", "A.map.h5", "--json", "r.json", "--png", "new"},
                 named);
  expect_refused({"info", "bad.h5"}, named);
}

BadFile recording_with(const char* name, std::function<void(FileParts&)> spoil,
                       std::vector<std::string> named) {
  return {name,
          [spoil](const auto& path) {
            FileParts parts = recording_parts();
            spoil(parts);
            parts.save(path);
          },
          std::move(named)};
}

INSTANTIATE_TEST_SUITE_P(
    All, BadRecording,
    testing::Values(
        BadFile{"missing", [](const auto&) {}, {"no such file", "check the path"}},
        BadFile{"empty_file", [](const auto& path) { put_bytes(path, ""); }, {"is empty", "again"}},
        BadFile{"a_folder",
                [](const auto& path) { std::filesystem::create_directory(path); },
                {"is a folder", "name a file"}},
        BadFile{"not_hdf5",
                [](const auto& path) { put_bytes(path, "x y z\n1 2 3\n"); },
                {"is not an HDF5 file", "give a file"}},
        BadFile{"truncated",
                [](const auto& path) {
                  recording_parts().save(path);
                  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
                },
                {"is truncated", "again"}},
        recording_with("wrong_format", [](auto& file) { file.attribute("format", "other.tool"); },
                       {"'other.tool'", "give a"}),
        recording_with("no_format", [](auto& file) { file.without("format"); },
                       {"'format'", "give a"}),
        recording_with("higher_version", [](auto& file) { file.attribute("version", 2); },
                       {"'version' = 2", "update"}),
        recording_with("no_pressure", [](auto& file) { file.without("pressure"); },
                       {"'pressure' is missing", "add it"}),
        recording_with("no_sensor_pose", [](auto& file) { file.without("sensor_pose"); },
                       {"'sensor_pose' is missing", "add it"}),
        recording_with("no_elements", [](auto& file) { file.without("elements"); },
                       {"'elements' is missing", "add it"}),
        recording_with("fewer_poses",
                       [](auto& file) {
                         file.dataset("sensor_pose", {1, 3});
                       },
                       {"'sensor_pose'", "[1, 3]", "make it [2, 3]"}),
        recording_with("more_elements",
                       [](auto& file) {
                         file.dataset("elements", {4, 2});
                       },
                       {"'elements'", "[4, 2]", "make it [3, 2]"}),
        recording_with("other_valid", [](auto& file) { file.dataset("valid", {2}); },
                       {"'valid'", "make it [3]"}),
        recording_with("no_touches",
                       [](auto& file) {
                         file.dataset("pressure", {0, 3}).dataset("sensor_pose", {0, 3});
                       },
                       {"'pressure' is empty", "at least one touch"}),
        recording_with("nan_pressure",
                       [](auto& file) {
                         file.dataset("pressure", {2, 3}, nan);
                       },
                       {"'pressure'[0, 0] = nan", "store finite"}),
        recording_with("infinite_pressure",
                       [](auto& file) {
                         file.dataset("pressure", {2, 3}, infinity);
                       },
                       {"'pressure'[0, 0] = inf", "store finite"}),
        recording_with("nan_pose",
                       [](auto& file) {
                         file.dataset("sensor_pose", {2, 3}, nan);
                       },
                       {"'sensor_pose'[0]", "store finite"}),
        recording_with("infinite_pose",
                       [](auto& file) {
                         file.dataset("sensor_pose", {2, 3}, -infinity);
                       },
                       {"'sensor_pose'[0]", "store finite"}),
        recording_with("other_unit", [](auto& file) { file.attribute("pressure_unit", "psi"); },
                       {"'pressure_unit' = 'psi'", "make it"})),
    [](const auto& test) { return test.param.name; });

class BadMap : public BadInput, public testing::WithParamInterface<BadFile> {};

TEST_P(BadMap, IsRefused) {
  GetParam().make(folder_ / "bad.map.h5");
  std::vector<std::string> named = GetParam().named;
  named.push_back("bad.map.h5: ");
  expect_refused({"recognize", "u.h5", "--maps", "A.map.h5", "bad.map.h5", "--json", "r.json",
                  "--posterior", "p.h5", "--png", "new"},
                 named);
}

BadFile map_with(const char* name, std::function<void(FileParts&)> spoil,
                 std::vector<std::string> named) {
  return {name,
          [spoil](const auto& path) {
            FileParts parts = map_parts();
            spoil(parts);
            parts.save(path);
          },
          std::move(named)};
}

INSTANTIATE_TEST_SUITE_P(
    All, BadMap,
    testing::Values(
        BadFile{"missing", [](const auto&) {}, {"no such file", "check the path"}},
        BadFile{"not_hdf5", [](const auto& path) { put_bytes(path, "map"); }, {"is not an HDF5"}},
        BadFile{"a_recording",
                [](const auto& path) { recording_parts().save(path); },
                {"this is a recording", "give a map"}},
        BadFile{"folder_with_a_recording_named_as_a_map",
                [](const auto& path) {
                  std::filesystem::create_directory(path);
                  recording_parts().save(path / "bad.map.h5");
                },
                {"this is a recording", "give a map"}},
        BadFile{"folder_without_maps",
                [](const auto& path) { std::filesystem::create_directory(path); },
                {"a folder without maps", "build some"}},
        map_with("higher_version", [](auto& file) { file.attribute("version", 9); },
                 {"'version' = 9", "update"}),
        map_with("no_log_odds", [](auto& file) { file.without("log_odds"); },
                 {"'log_odds' is missing", "add it"}),
        map_with("no_cells",
                 [](auto& file) {
                   file.dataset("log_odds", {0, 3});
                 },
                 {"'log_odds'", "at least one cell"}),
        map_with("nan_log_odds",
                 [](auto& file) {
                   file.dataset("log_odds", {2, 3}, nan);
                 },
                 {"'log_odds'[0, 0] = nan", "give finite numbers"}),
        map_with("zero_cell", [](auto& file) { file.attribute("cell_mm", 0.0); },
                 {"'cell_mm' = 0", "give 1e-06 to 1e+06 mm"}),
        map_with("label_of_none", [](auto& file) { file.attribute("label", "(none)"); },
                 {"'label' = '(none)'", "choose another"}),
        map_with("certain_prior", [](auto& file) { file.attribute("prior", 1.0); },
                 {"'prior' = 1", "between 0 and 1"}),
        map_with("other_prior", [](auto& file) { file.attribute("prior", 0.4); },
                 {"prior 0.4 differs", "holds no touches", "A.map.h5", "--prior"})),
    [](const auto& test) { return test.param.name; });

TEST_F(BadInput, FolderMayNameNoMapEither) {
  std::filesystem::create_directory(folder_ / "maps");
  std::filesystem::copy(folder_ / "u.h5", folder_ / "maps/u.h5");
  expect_refused({"recognize", "u.h5", "--maps", "maps"}, {"maps: ", "without maps", "build"});
}

TEST_F(BadInput, TheSameMapTwice) {
  expect_refused({"recognize", "u.h5", "--maps", "A.map.h5", "./A.map.h5"},
                 {"A.map.h5", "twice", "leave one out"});
  std::filesystem::create_hard_link(folder_ / "A.map.h5", folder_ / "hard.h5");
  expect_refused({"recognize", "u.h5", "--maps", "A.map.h5", "hard.h5"}, {"hard.h5", "twice"});
}

TEST_F(BadInput, TheSameRecordingTwice) {
  expect_refused({"recognize", "u.h5", "./u.h5", "--maps", "A.map.h5"},
                 {"u.h5", "twice", "leave one out"});
  expect_refused({"map", "A.h5", "./A.h5", "-o", "out.map.h5"}, {"A.h5", "twice"});
  std::filesystem::create_hard_link(folder_ / "A.h5", folder_ / "hard.h5");
  expect_refused({"map", "A.h5", "hard.h5", "-o", "out.map.h5"}, {"hard.h5", "twice"});
}

TEST_F(BadInput, RawStream) {
  Recording stream = sample_training("A", 3);
  stream.rows = "frames";
  write_recording(folder_ / "stream.h5", stream);
  for (const Arguments& command : {Arguments{"map", "stream.h5", "-o", "out.map.h5"},
                                   Arguments{"recognize", "stream.h5", "--maps", "A.map.h5"}}) {
    expect_refused(command, {"stream.h5", "rows = frames", "palpate touches"});
  }
}

TEST_F(BadInput, RawPressureWithoutAThreshold) {
  Recording raw = sample_training("A", 3);
  raw.pressure_unit = "raw";
  write_recording(folder_ / "raw.h5", raw);
  for (const Arguments& command : {Arguments{"map", "raw.h5", "-o", "out.map.h5"},
                                   Arguments{"recognize", "raw.h5", "--maps", "A.map.h5"}}) {
    expect_refused(command, {"raw.h5", "pressure_unit = raw", "give --threshold"});
  }
  expect_refused({"map", "A.h5", "raw.h5", "-o", "out.map.h5", "--threshold", "2"},
                 {"raw.h5", "pressure_unit", "a call for each"});
}

TEST_F(BadInput, NothingIsKnownAfterClassification) {
  Recording silent = sample_training("A", 3);
  silent.valid.assign(silent.elements(), 0);
  write_recording(folder_ / "silent.h5", silent);
  expect_refused({"map", "silent.h5", "-o", "new/", "--png", "new.png"}, {"Contact"});
}

TEST_F(BadInput, UnknownObjectWithoutALabel) {
  expect_refused({"map", "u.h5", "-o", "out/"}, {"u.h5", "'object' is empty", "--label"});
  EXPECT_EQ(palpate({"map", "u.h5", "-o", "out/", "--label", "A"}).status, 0);
}

TEST_F(BadInput, LabelsThatNameNoFile) {
  expect_refused(with(map, {"--label", "a/b"}), {"'a/b'", "--label"});
  expect_refused(with(map, {"--label", "a\nb"}), {"--label", "printable"});
}

TEST_F(BadInput, SeveralLabelsForOneFile) {
  expect_refused({"map", "A.h5", "I.h5", "-o", "out.map.h5"},
                 {"I.h5", "'I' differs from 'A'", "--output out.map.h5/", "--label"});
}

TEST_F(BadInput, SeveralUnknownsForOnePosterior) {
  expect_refused(with(recognize, {"--each-frame", "--posterior", "p.h5"}),
                 {"--posterior p.h5", "not 3", "select one"});
}

TEST_F(BadInput, PicturesThatWouldOverwriteEachOther) {
  std::filesystem::create_directory(folder_ / "other");
  std::filesystem::copy(folder_ / "u.h5", folder_ / "other/u.h5");
  expect_refused({"recognize", "u.h5", "other/u.h5", "--maps", "A.map.h5", "--png", "new"},
                 {"other/u.h5", "same name", "rename"});
}

TEST_F(BadInput, OutputsInAFolderThatDoesNotExist) {
  const std::vector<std::string> named{"nowhere", "does not exist", "create it"};
  expect_refused({"simulate", "A", "-o", "nowhere/out.h5"}, named);
  expect_refused({"map", "A.h5", "-o", "nowhere/out.map.h5"}, named);
  expect_refused(with(map, {"--png", "nowhere/out.png"}), named);
  expect_refused(with(recognize, {"--json", "nowhere/r.json", "--png", "new"}), named);
  expect_refused(with(recognize, {"--posterior", "nowhere/p.h5", "--json", "r.json"}), named);
}

TEST_F(BadInput, OutputsThatAreFolders) {
  std::filesystem::create_directory(folder_ / "folder");
  const std::vector<std::string> named{"folder", "is a folder", "give the name of a file"};
  expect_refused({"simulate", "A", "-o", "folder"}, named);
  expect_refused(with(map, {"--png", "folder"}), named);
  expect_refused(with(recognize, {"--json", "folder"}), named);
  std::filesystem::create_directories(folder_ / "sheets/u.1.png");
  expect_refused(with(recognize, {"--each-frame", "--json", "r.json", "--png", "sheets"}),
                 {"sheets/u.1.png", "is a folder"});
}

TEST_F(BadInput, FolderThatIsAFile) {
  expect_refused({"map", "A.h5", "-o", "u.h5/"}, {"u.h5", "folder"});
  expect_refused(with(recognize, {"--png", "u.h5"}), {"u.h5", "folder", "choose another"});
}

TEST_F(BadInput, NameThatIsTooLong) {
  const std::string name(300, 'x');
  expect_refused({"recognize", "u.h5", "--maps", name}, {name});
  expect_refused({"info", name}, {name});
}

TEST_F(BadInput, NameOfSeveralLines) { expect_refused({"info", "a\nb"}, {"a b: no such file"}); }

TEST_F(BadInput, DeviceThatDoesNotExist) {
  for (const char* device : {"99", "no such device"}) {
    const std::vector<std::string> named{"device", device, "palpate devices"};
    expect_refused({"map", "A.h5", "-o", "new/", "--png", "new.png", "--device", device}, named);
    expect_refused(with(recognize, {"--device", device, "--json", "r.json", "--png", "new"}),
                   named);
  }
}

TEST_F(BadInput, ShapeThatDoesNotExist) {
  expect_refused({"simulate", "Ampersand", "-o", "out.h5"}, {"'Ampersand'", "give A to Z"});
}

TEST_F(BadInput, CommandLineWithoutACommand) {
  expect_refused({}, {"subcommand is required", "--help"});
  expect_refused({"frobnicate", "u.h5"}, {"'frobnicate'", "no command", "--help"});
  expect_refused({"--frobnicate"}, {"'--frobnicate'", "--help"});
}

TEST_F(BadInput, CommandLineWithoutItsArguments) {
  expect_refused({"simulate", "A"}, {"--output is required", "palpate simulate --help"});
  expect_refused({"simulate", "-o", "out.h5"}, {"SHAPE is required"});
  expect_refused({"map", "-o", "out.map.h5"}, {"RECORDING is required", "palpate map --help"});
  expect_refused({"recognize", "--maps", "A.map.h5"}, {"RECORDING is required"});
  expect_refused({"recognize", "u.h5"}, {"--maps: missing", "--scene"});
  expect_refused({"info"}, {"FILE is required"});
}

TEST_F(BadInput, UnknownFlag) {
  for (const Arguments& command :
       {simulate, map, recognize, Arguments{"info", "u.h5"}, Arguments{"devices"}}) {
    expect_refused(with(command, {"--frobnicate"}),
                   {"--frobnicate", "palpate " + command.front() + " --help"});
  }
}

TEST_F(BadInput, FilterThatIsNotThere) {
  expect_refused(with(recognize, {"--filter", "kalman"}),
                 {"--filter kalman", "histogram", "bounded"});
}

TEST_F(BadInput, FlagsOfTheOtherFilter) {
  for (const Arguments& flags :
       {Arguments{"--particles", "100"}, Arguments{"--seed", "1"},
        Arguments{"--resampling", "systematic"}, Arguments{"--augmented"}}) {
    expect_refused(with(recognize, flags), {flags.front(), "add --filter particles"});
  }
  expect_refused(with(recognize, {"--filter", "particles", "--posterior", "p.h5"}),
                 {"--posterior p.h5", "use --filter histogram"});
}

TEST_F(BadInput, ParticlesOutOfRange) {
  const Arguments particles = with(recognize, {"--filter", "particles"});
  for (const char* count : {"0", "-1", "1000001", "ten"}) {
    expect_refused(with(particles, {"--particles", count}), {"--particles", count});
  }
  expect_refused(with(particles, {"--resampling", "best"}), {"--resampling best", "systematic"});
  expect_refused(with(particles, {"--seed", "-1"}), {"--seed", "-1"});
}

}  // namespace palpate::bad_input_test
