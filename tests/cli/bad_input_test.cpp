// Whatever is wrong with the input is said in one line that names it and a remedy, and leaves no
// trace. Every case starts from files with which the same commands succeed. Which contents of files
// are refused is tested where they are read; libhdf5 is known to crash and to loop on damaged ones,
// and the command must do neither.

#include <algorithm>
#include <random>

#include "io/file_parts.hpp"
#include "letter_files.hpp"
#include "support/trials.hpp"

namespace palpate::bad_input_test {

/// Commands that succeed.
const std::string recognize = "recognize u.h5 --maps maps/A.map.h5";
const std::string map = "map A.h5 -o out.map.h5";

using BadInput = LetterFiles;

TEST_F(BadInput, RecordingsThatCannotBeRead) {
  std::filesystem::copy(folder_ / "A.h5", folder_ / "bad.h5");
  std::filesystem::resize_file(folder_ / "bad.h5", 4000);
  for (const char* command :
       {"map A.h5 bad.h5 -o out/ --png out.png", "info bad.h5",
        "recognize bad.h5 --maps maps --json r.json --posterior p.h5 --png new"}) {
    expect_refused(command, {"bad.h5: ", "is truncated", "again"});
  }
}

TEST_F(BadInput, RecordingsWithoutTouchesOrAThreshold) {
  Recording stream = sample_training("A", 3);
  stream.rows = "frames";
  write_recording(folder_ / "stream.h5", stream);
  Recording raw = sample_training("A", 3);
  raw.pressure_unit = "raw";
  write_recording(folder_ / "raw.h5", raw);
  Recording silent = sample_training("A", 3);
  silent.valid.assign(silent.elements(), 0);
  write_recording(folder_ / "silent.h5", silent);
  for (const std::string command :
       {"map -o new/ --png new.png ", "recognize --json r.json --maps maps -- "}) {
    expect_refused(command + "stream.h5", {"stream.h5", "rows = frames", "palpate touches"});
    expect_refused(command + "raw.h5", {"raw.h5", "pressure_unit = raw", "give --threshold"});
  }
  expect_refused("map raw.h5 -o new/ --unposed", {"raw.h5: no sensor model: it", "--threshold"});
  expect_refused("map silent.h5 -o new/ --png new.png", {"Contact"});
  expect_refused("map A.h5 raw.h5 -o out.map.h5 --threshold 2",
                 {"raw.h5", "pressure_unit", "a call for each"});
}

TEST_F(BadInput, FilesThatCannotBeReadOrDoNotGoTogether) {
  for (const char* folder : {"mixed", "none", "empty"}) {
    std::filesystem::create_directory(folder_ / folder);
  }
  std::filesystem::copy(folder_ / "u.h5", folder_ / "none/u.h5");
  recording_parts().save(folder_ / "mixed/bad.map.h5");
  std::filesystem::create_hard_link(folder_ / "maps/A.map.h5", folder_ / "hard.map.h5");
  std::filesystem::create_hard_link(folder_ / "A.h5", folder_ / "hard.h5");
  const std::string long_name(300, 'x');
  const std::string with_a = "recognize u.h5 --json r.json --png new --maps maps/A.map.h5 ";
  expect_each_refused(
      {{with_a + "missing.map.h5", {"missing.map.h5: no such file", "check the path"}},
       {with_a + "u.h5", {"u.h5: ", "this is a recording", "give a map"}},
       {with_a + "mixed", {"mixed/bad.map.h5: ", "this is a recording"}},
       {with_a + "none", {"none: a folder without maps", "build some"}},
       {with_a + "empty", {"empty: a folder without maps"}},
       {with_a + "maps/../maps/A.map.h5", {"A.map.h5: ", "twice", "leave one out"}},
       {with_a + "hard.map.h5", {"hard.map.h5: ", "twice"}},
       {"recognize u.h5 ./u.h5 --maps maps", {"u.h5", "twice", "leave one out"}},
       {"map A.h5 hard.h5 -o out.map.h5", {"hard.h5", "twice"}},
       {with_a + long_name, {long_name}}});
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

TEST_F(BadInput, FlagsThatDoNotGoTogetherAndDevicesThatAreNotThere) {
  expect_each_refused(
      {{recognize + " --filter particles --posterior p.h5",
        {"--posterior p.h5", "use --filter histogram"}},
       {recognize + " --each-frame --touches 1", {"--touches", "--each-frame", "leave one"}},
       {"map A.h5 -o new/ --png new.png --device 99", {"device", "99", "palpate devices"}},
       {recognize + " --json r.json --png new --device none-such",
        {"device", "none-such", "palpate devices"}}});
}

class DamagedInput : public ProgramTest {
 protected:
  DamagedInput() {
    write_recording(folder_ / "u.h5", sample_unknown("A", {}, 2));
    OccupancyGrid map{.label = "A", .nx = 4, .ny = 4};
    map.log_odds.assign(16, 1.0F);
    write_map(folder_ / "A.map.h5", map);
    // Unlike the others a compressed file.
    Posterior posterior;
    posterior.objects = {"A", "B"};
    posterior.lattice.theta_rad.count = 2;
    posterior.log_likelihood.assign(2u * 2 * 25 * 25, -3.0);
    write_posterior(folder_ / "p.h5", posterior);
  }

  /// The bytes cut short, or with a bit flipped anywhere or in the first pages: beyond them a file
  /// is mostly values, few of which can be wrong.
  std::string damaged(std::string bytes, int kind) {
    const std::size_t within = kind == 2 ? std::min<std::size_t>(2048, bytes.size()) : bytes.size();
    const std::size_t at = random_() % within;
    if (kind == 0) {
      bytes.resize(at);
    } else {
      bytes[at] = static_cast<char>(bytes[at] ^ (1 << random_() % 8));
    }
    return bytes;
  }

  std::mt19937 random_{20110509};
};

TEST_F(DamagedInput, IsReadOrRefusedInOneLine) {
  const std::string recognize =
      "recognize u.h5 --maps A.map.h5 --bins 5x5x4 --json - --filter=bounded";
  for (const auto& [name, command, damages] :
       {std::tuple<std::string, std::string, int>{"u.h5", "info u.h5", 18},
        {"A.map.h5", "info A.map.h5", 18},
        {"p.h5", "info p.h5", 18},
        {"u.h5", recognize, 6},
        {"A.map.h5", recognize, 6}}) {
    const std::string good = bytes_of(folder_ / name);
    int refused = 0;
    for (int k = 0; k < damages; ++k) {
      SCOPED_TRACE(command + ", damage " + std::to_string(k));
      put_bytes(folder_ / name, damaged(good, k % 3));
      const auto [status, out, err] = palpate(command);
      if (status == 0) {
        EXPECT_EQ(err, "");
        continue;
      }
      ++refused;
      EXPECT_EQ(status, 2) << err;
      EXPECT_EQ(out, "");
      // A sanitizer gives its own account of a crash before the line.
      const std::size_t at = err.rfind("palpate: ");
      EXPECT_TRUE(at == 0 || (sanitized && at != err.npos)) << err;
      EXPECT_EQ(err.find('\n', at), err.size() - 1) << err;
      EXPECT_NE(err.find(name, at), err.npos) << err;
    }
    EXPECT_GE(refused, damages / 3) << "every truncated file is refused";
    put_bytes(folder_ / name, good);
  }
}

// Within the file a link is as good as the dataset; to another file, on whatever way, it is none.
TEST_F(DamagedInput, LinksAreFollowedWithinTheFile) {
  const auto change = [&](const char* target) {
    recording_parts().save(folder_ / "linked.h5");
    edit(folder_ / "linked.h5", [&](hid_t file) {
      H5Lmove(file, "pressure", file, "numbers", H5P_DEFAULT, H5P_DEFAULT);
      H5Lcreate_external("u.h5", "/", file, "away", H5P_DEFAULT, H5P_DEFAULT);
      H5Lcreate_soft(target, file, "pressure", H5P_DEFAULT, H5P_DEFAULT);
    });
  };
  change("/numbers");
  done("info linked.h5");
  change("/away/pressure");
  expect_refused("info linked.h5", {"linked.h5", "'pressure'", "link"});
}

}  // namespace palpate::bad_input_test
