#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::recognize_flags_test {

using nlohmann::json;

class RecognizeFlags : public ProgramTest {
 protected:
  RecognizeFlags() {
    std::filesystem::create_directory(folder_ / "maps");
    write_map(folder_ / "maps/A.map.h5", sample_map("A"));
    write_map(folder_ / "maps/I.map.h5", sample_map("I"));
    write_recording(folder_ / "u.h5", sample_unknown("A", {{2.0, -3.0}, 1.0}, 6));
  }

  /// The mode of u.h5 with these flags.
  json mode(std::vector<std::string> flags) const {
    flags.insert(flags.begin(), {"u.h5", "--maps", "maps"});
    return record(flags)["mode"];
  }
};

// The lattice's defaults are in defaults_test.cpp.
TEST_F(RecognizeFlags, DefaultsAreTheDocumentedOnes) {
  const json bare = mode({"--bins=9x9x8"});
  EXPECT_EQ(mode({"--bins=9x9x8", "--prior", "0.2", "--gamma", "0.1", "--threshold", "2", "--ratio",
                  "0.3", "--frames", "0:6", "--touches", "6", "--filter", "histogram"}),
            bare);
  EXPECT_EQ(mode({"--bins=9x9x8", "--filter", "auto"}), bare);
}

TEST_F(RecognizeFlags, EveryFlagOfTheModelMatters) {
  const char* const by = "--filter=bounded";  // which needs no device
  const json bare = mode({"--bins=25x25x16", by});
  for (const char* flag : {"--bins=24x25x16", "--x-mm=-9:10", "--y-mm=-9:10", "--theta-deg=5:365",
                           "--pivot-mm=1.3,0"}) {
    EXPECT_NE(mode({flag, by}), bare) << flag;
  }
  for (const char* flag : {"--prior=0.4", "--gamma=0.3", "--threshold=6", "--ratio=0.7",
                           "--frames=0:3", "--touches=3"}) {
    EXPECT_NE(mode({"--bins=25x25x16", flag, by}), bare) << flag;
  }
}

TEST_F(RecognizeFlags, FineBinsAreChosenByTheMapsAndSaid) {
  for (const char* letter : {"A", "I"}) {
    write_map(folder_ / fmt::format("maps/{}.map.h5", letter), sample_map(letter, 0.5));
  }
  const std::vector<std::string> region{"--x-mm=1:3", "--y-mm=-4:-2.5", "--theta-deg=40:70",
                                        "--filter=bounded"};
  std::vector<std::string> chosen{"recognize", "u.h5", "--maps", "maps", "--bins", "fine"};
  chosen.insert(chosen.end(), region.begin(), region.end());
  const std::string out = done(chosen);
  // 2 and 1.5 mm in steps of 0.3.
  const std::size_t counts = out.find("7 x 5 x ");
  ASSERT_NE(counts, std::string::npos) << out;
  const int angles = std::stoi(out.substr(counts + 8));
  // 30 degrees of a lever of some 9 mm, the letters' and the pivot's distance from their middle.
  EXPECT_NEAR(angles, 0.52 * 9.0 / 0.3, 3);
  std::vector<std::string> automatic = region;
  automatic.emplace_back("--bins=fine");
  std::vector<std::string> by_hand = region;
  by_hand.push_back(fmt::format("--bins=7x5x{}", angles));
  const json wanted = mode(by_hand);
  EXPECT_EQ(mode(automatic), wanted);
  put_bytes(folder_ / "fine.yaml",
            "bins: fine\nregion: {x_mm: [1, 3], y_mm: [-4, -2.5], theta_deg: [40, 70]}\n");
  EXPECT_EQ(mode({"--scene=fine.yaml", "--filter=bounded"}), wanted);
}

TEST_F(RecognizeFlags, FineBinsAreNotFinerThanTheSensorShows) {
  write_recording(folder_ / "train.h5", sample_training("A", 48));
  done({"map", "train.h5", "--cell-mm", "0.25", "--spread-mm", "0.5", "-o", "fine.map.h5"});
  const std::vector<std::string> recognize{"recognize",   "u.h5",           "--maps",
                                           "fine.map.h5", "--bins",         "fine",
                                           "--x-mm=1:3",  "--y-mm=-4:-2.5", "--theta-deg=40:70"};
  const std::string out = done(recognize);
  EXPECT_NE(out.find("7 x 5 x "), std::string::npos) << "steps of 0.3 mm\n" << out;
  // The cells decide where a map does not know its spread.
  OccupancyGrid map = read_map(folder_ / "fine.map.h5");
  map.spread_mm.reset();
  write_map(folder_ / "fine.map.h5", map);
  const std::string finer = done(recognize);
  EXPECT_NE(finer.find("14 x 10 x "), std::string::npos) << finer;
}

TEST_F(RecognizeFlags, FramesAreHalfOpen) {
  const json selected = mode({"--bins=25x25x16", "--frames", "2:5"});
  write_recording(folder_ / "u.h5", part_of(sample_unknown("A", {{2.0, -3.0}, 1.0}, 6), 2, 5));
  EXPECT_EQ(mode({"--bins=25x25x16"}), selected);
}

TEST_F(RecognizeFlags, TouchesAreTheFirstOfTheFrames) {
  const std::string few = "--bins=25x25x16";
  const std::string by = "--filter=bounded";
  EXPECT_EQ(mode({few, by, "--touches=4"}), mode({few, by, "--frames=0:4"}));
  EXPECT_EQ(mode({few, by, "--frames=2:6", "--touches=3"}), mode({few, by, "--frames=2:5"}));
}

TEST_F(RecognizeFlags, AFixedAngleIsOneBin) {
  const json fixed = mode({"--theta-deg", "57.5:57.5", "--posterior", "p.h5"});
  EXPECT_DOUBLE_EQ(fixed["theta_rad"].get<double>(), 57.5 * std::numbers::pi / 180.0);
  const Posterior posterior = read_posterior(folder_ / "p.h5");
  EXPECT_EQ(posterior.lattice.theta_rad.count, 1);
  EXPECT_EQ(posterior.lattice.x_mm.count, 25);
}

TEST_F(RecognizeFlags, APivotOnlyMovesTheLattice) {
  // p_o = R(theta) (p_r - pivot) + (x, y): with the angle fixed, ranges moved by R(theta) pivot
  // describe the same poses, and these are reported without the pivot.
  constexpr double theta_deg = 57.0;
  const glm::dvec2 pivot_mm{20.0, -15.0};
  const glm::dvec2 shift_mm = rotate(theta_deg * std::numbers::pi / 180.0, pivot_mm);
  const std::string angle = fmt::format("--theta-deg={0}:{0}", theta_deg);
  const json plain = mode({angle});
  const json pivoted = mode({angle, fmt::format("--pivot-mm={},{}", pivot_mm.x, pivot_mm.y),
                             fmt::format("--x-mm={}:{}", shift_mm.x - 10.0, shift_mm.x + 10.0),
                             fmt::format("--y-mm={}:{}", shift_mm.y - 10.0, shift_mm.y + 10.0)});
  EXPECT_EQ(pivoted["object"], plain["object"]);
  EXPECT_NEAR(pivoted["x_mm"].get<double>(), plain["x_mm"].get<double>(), 1e-9);  // rounding
  EXPECT_NEAR(pivoted["y_mm"].get<double>(), plain["y_mm"].get<double>(), 1e-9);
  EXPECT_EQ(pivoted["theta_rad"], plain["theta_rad"]);
  // The device computes positions some 30 mm from the origin in floats, good to 4e-6 mm, on a map
  // that changes by 8 nats in 1 mm, for 6 touches of 36 elements: 0.007 nats at the very most.
  EXPECT_NEAR(pivoted["log_likelihood"].get<double>(), plain["log_likelihood"].get<double>(),
              0.007);
}

TEST_F(RecognizeFlags, APriorReconcilesMapsThatDiffer) {
  OccupancyGrid other = sample_map("I");
  other.prior = 0.3;
  write_map(folder_ / "maps/I.map.h5", other);
  expect_refused({"recognize", "u.h5", "--maps", "maps"}, {"I.map.h5", "prior", "--prior"});
  EXPECT_EQ(mode({"--prior", "0.2"})["object"], "A");
}

TEST_F(RecognizeFlags, AFolderStandsForItsMaps) {
  put_bytes(folder_ / "maps/notes.txt", "not a map");
  std::filesystem::copy(folder_ / "u.h5", folder_ / "maps/u.h5");
  const json by_folder = record({"u.h5", "--maps", "maps"});
  const json by_name = record({"u.h5", "--maps", "maps/A.map.h5", "maps/I.map.h5"});
  EXPECT_EQ(by_folder["mode"], by_name["mode"]);
  EXPECT_EQ(by_folder["identity"], by_name["identity"]);
}

TEST_F(RecognizeFlags, RawPressureIsClassifiedByItsOwnThreshold) {
  const json usual = mode({});
  Recording raw = read_recording(folder_ / "u.h5");
  raw.pressure_unit = "raw";
  for (double& pressure : raw.pressure) {
    pressure *= 8.0;  // exact in binary
  }
  write_recording(folder_ / "u.h5", raw);
  EXPECT_EQ(mode({"--threshold", "16"}), usual);
}

TEST_F(RecognizeFlags, AnArrayMayChangeFromTouchToTouch) {
  const json usual = mode({});
  Recording recording = read_recording(folder_ / "u.h5");
  const std::vector<glm::dvec2> array = recording.elements_mm;
  for (std::size_t i = 1; i < recording.size(); ++i) {
    recording.elements_mm.insert(recording.elements_mm.end(), array.begin(), array.end());
  }
  write_recording(folder_ / "u.h5", recording);
  EXPECT_EQ(mode({}), usual);
}

TEST_F(RecognizeFlags, PicturesAreNamedAfterTheirUnknowns) {
  write_recording(folder_ / "v.h5", sample_unknown("I", {}, 3));
  done({"recognize", "u.h5", "v.h5", "--maps", "maps", "--png", "new/sheets", "--touches", "2"});
  done({"recognize", "u.h5", "--maps", "maps", "--png", "frames", "--each-frame", "--frames", "4:6",
        "--bins", "15x15x12"});
  for (const char* name :
       {"new/sheets/u.png", "new/sheets/v.png", "frames/u.4.png", "frames/u.5.png"}) {
    EXPECT_TRUE(bytes_of(folder_ / name).starts_with("\x89PNG")) << name;
  }
  EXPECT_EQ(content_of(folder_ / "new/sheets").size(), 2u);
}

TEST_F(RecognizeFlags, PicturesAndTracesLeaveTheRecordAlone) {
  // Bounds search after every touch where a trace or a picture asks for it.
  std::vector<std::string> call{"u.h5", "--maps=maps", "--filter=bounded", "--bins=25x25x16"};
  const json plain = record(call);
  call.insert(call.end(), {"--png", "sheets"});
  const json drawn = record(call);
  EXPECT_FALSE(drawn.contains("trace"));
  EXPECT_EQ(drawn["best"], plain["best"]);
  EXPECT_EQ(drawn["T_robot_object"], plain["T_robot_object"]);
}

TEST_F(RecognizeFlags, MoreBinsThanTheDeviceHoldsLeaveNothing) {
  const auto before = content_of(folder_.path());
  const Outcome outcome =
      palpate({"recognize", "u.h5", "--maps", "maps", "--bins", "2000000000x2000000000x2000000000",
               "--json", "r.json", "--png", "sheets"});
  EXPECT_EQ(outcome.status, 2) << "the number is the user's";
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  expect_named(outcome.err, {"bins", "use fewer"});
  EXPECT_TRUE(content_of(folder_.path()) == before) << "the folder has changed";
}

TEST_F(RecognizeFlags, TableShowsWhatWasTakenForWhat) {
  write_recording(folder_ / "i.h5", sample_unknown("I", {}, 6));
  const std::string table =
      done({"recognize", "u.h5", "i.h5", "--maps", "maps/A.map.h5", "--trace", "--none", "0"});
  EXPECT_NE(table.find("1 of 2 right (50.0 %)"), std::string::npos) << table;
  EXPECT_NE(table.find("taken for"), std::string::npos) << table;
}

}  // namespace palpate::recognize_flags_test
