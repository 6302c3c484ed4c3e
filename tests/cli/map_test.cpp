#include <cmath>

#include "io/hdf5_contents.hpp"
#include "letter_files.hpp"
#include "model/element_spacing.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/simulation.hpp"

namespace palpate::map_test {

class MapCommand : public LetterFiles {
 protected:
  /// The map of A.h5 built with these flags.
  OccupancyGrid map_of_a(const std::string& flags = "") const {
    done("map A.h5 -o A.map.h5 " + flags);
    return read_map(folder_ / "A.map.h5");
  }
  /// The map of a recording in the place of A.h5.
  OccupancyGrid map_of(const Recording& recording, const std::string& flags = "") const {
    write_recording(folder_ / "A.h5", recording);
    return map_of_a(flags);
  }

  Recording training_ = sample_training("A", 48);
};

TEST_F(MapCommand, FolderGetsAMapPerLabelAndPicturesOfAll) {
  done("map A.h5 I.h5 -o new/maps/ --sensor-model none --png maps.png --ros ros");
  EXPECT_EQ(content_of(folder_ / "new/maps").size(), 2u);
  const OccupancyGrid a = read_map(folder_ / "new/maps/A.map.h5");
  const OccupancyGrid i = read_map(folder_ / "new/maps/I.map.h5");
  EXPECT_EQ(a.label, "A");
  EXPECT_EQ(i.label, "I");
  EXPECT_EQ(a.symmetry, 1);
  EXPECT_EQ(a.cell_mm, 0.5);
  EXPECT_EQ(a.prior, i.prior) << "pooled over all objects of the call";
  for (const double origin : {a.origin_mm.x, a.origin_mm.y, i.origin_mm.x, i.origin_mm.y}) {
    EXPECT_EQ(origin / 0.5, std::round(origin / 0.5)) << "a whole multiple of the cell";
  }
  EXPECT_TRUE(bytes_of(folder_ / "maps.png").starts_with("\x89PNG"));
  const auto exported = content_of(folder_ / "ros");
  EXPECT_EQ(exported.size(), 4u);
  for (const char* name : {"A.pgm", "A.yaml", "I.pgm", "I.yaml"}) {
    EXPECT_TRUE(exported.contains(name)) << name;
  }
  // A folder that exists needs no slash.
  done("map A.h5 -o new --label B");
  EXPECT_EQ(read_map(folder_ / "new/B.map.h5").label, "B");
}

TEST_F(MapCommand, RefusesAtOnceWhatHasNoOutline) {
  Recording all = part_of(training_, 0, 12);
  for (std::size_t k = 0; k < all.pressure.size(); ++k) {
    all.pressure[k] = 5.0 + 0.1 * static_cast<double>(k % 7);
  }
  write_recording(folder_ / "all.h5", all);
  expect_refused(
      "map all.h5 -o maps/",
      {"object 'A': every element is in contact in all 12 touches", "5 kPa", "--threshold"});
  write_recording(folder_ / "few.h5", part_of(all, 0, 9));
  done("map few.h5 -o one.map.h5");
  all.pressure[40] = 1.0;
  write_recording(folder_ / "all.h5", all);
  done("map all.h5 -o one.map.h5");
}

TEST_F(MapCommand, SaysAndStoresTheSymmetryThatTheMapsShow) {
  const std::string out = done("map A.h5 I.h5 -o maps/ --sensor-model none");
  expect_named(out, {"A looks different after every turn, by ",
                     "I looks the same after every 1/2 of a turn, within 0.",
                     "--symmetry 2 always, --symmetry 1 never\n"});
  EXPECT_EQ(out.find("mirror image"), std::string::npos) << out;
  const OccupancyGrid i = read_map(folder_ / "maps/I.map.h5");
  EXPECT_EQ(i.suggested_symmetry, 2);
  EXPECT_EQ(i.symmetry, 1) << "as given";
  EXPECT_EQ(read_map(folder_ / "maps/A.map.h5").suggested_symmetry, 1);
  expect_named(done("map I.h5 -o I.map.h5 --mirror"),
               {"I looks the same as its mirror image, within 0."});
  const std::string given = done("map I.h5 -o I.map.h5 --symmetry 2");
  EXPECT_EQ(given.find("--symmetry"), std::string::npos) << given;
  done("map I.h5 -o I.map.h5 --symmetry 1");
  EXPECT_FALSE(read_map(folder_ / "I.map.h5").suggested_symmetry) << "not to be taken";
}

TEST(UsualSpread, IsAQuarterOfTheFinestPitch) {
  const auto spread_of = [](const std::vector<glm::dvec2>& elements_mm) {
    std::vector<Recording> recordings(2);
    for (Recording& recording : recordings) {
      recording.elements_mm = elements_mm;
      recording.pressure.resize(elements_mm.size());
      recording.T_robot_sensor.resize(1);
    }
    return usual_spread_mm(recordings);
  };
  EXPECT_EQ(spread_of(grid_array(10, 10, 1.0)), 0.25);
  EXPECT_EQ(spread_of(grid_array(6, 6, 2.0)), 0.5);
  EXPECT_EQ(spread_of(digitacts_array()), 0.5) << "as of 2 mm";
  EXPECT_NEAR(spread_of(grid_array(4, 4, 4.8)), 1.2, 1e-12);
  EXPECT_EQ(usual_spread_mm(std::nullopt), 0.5) << "one element has no pitch";
}

TEST_F(MapCommand, AlignsTouchesOfAnUncertainRobot) {
  const OccupancyGrid exact = map_of_a();
  EXPECT_EQ(map_of_a("--touch-sd-mm 0 --touch-sd-deg 0").log_odds, exact.log_odds);
  const Outcome run = palpate("map A.h5 -o A.map.h5 --touch-sd-mm 1 --touch-sd-deg 2.9");
  EXPECT_EQ(run.status, 0);
  expect_named(run.out, {"touches moved by 0."});
  expect_named(run.err, {"--touch-sd-mm says 1: give less"});
  const OccupancyGrid aligned = read_map(folder_ / "A.map.h5");
  EXPECT_NE(aligned.log_odds, exact.log_odds);
  // It is built from the aligned touches that it keeps.
  Device device = Device::open();
  EXPECT_EQ(with_prior(device, aligned, aligned.prior).log_odds, aligned.log_odds);
  expect_refused("map A.h5 -o new/ --touch-sd-mm 1 --unposed", {"--touch-sd-mm 1", "leave it out"});
}

TEST_F(MapCommand, DefaultsAreTheDocumentedOnes) {
  put_bytes(folder_ / "A.map.h5", "an older file");
  map_of_a();
  const std::string bare = bytes_of(folder_ / "A.map.h5");
  map_of_a(
      "--cell-mm 0.5 --spread-mm 0.5 --peak 0.9 --prior auto --threshold 2 --ratio 0.3 "
      "--frames 0:48 --origin auto --label A");
  EXPECT_TRUE(bytes_of(folder_ / "A.map.h5") == bare) << "the same input gives the same file";
  const Hdf5Contents file(folder_ / "A.map.h5", {"format", "version"}, {"log_odds"});
  EXPECT_EQ(file.text("format"), "palpate.map");
  EXPECT_EQ(file.integer("version", 0), 1);
}

TEST_F(MapCommand, TakesItsFlags) {
  const OccupancyGrid map = map_of_a("--cell-mm 1 --prior 0.3 --symmetry 0 --label other");
  EXPECT_EQ(map.cell_mm, 1.0);
  EXPECT_EQ(map.prior, 0.3);
  EXPECT_EQ(map.symmetry, 0);
  EXPECT_EQ(map.label, "other");
  EXPECT_EQ(map_of_a("--spread-mm 0.7").spread_mm, 0.7);
  const OccupancyGrid usual = map_of_a("--prior 0.2");
  EXPECT_NE(map_of_a("--prior 0.2 --peak 0.5").log_odds, usual.log_odds);
  EXPECT_NE(map_of_a("--prior 0.2 --ratio 0.6").log_odds, usual.log_odds);
}

TEST_F(MapCommand, IsOfTheTouchesThatAreGiven) {
  const OccupancyGrid whole = map_of_a();
  const OccupancyGrid selected = map_of_a("--frames 5:20");
  Recording raw = training_;
  raw.pressure_unit = "raw";
  for (double& pressure : raw.pressure) {
    pressure *= 8.0;  // exact in binary
  }
  EXPECT_EQ(map_of(raw, "--threshold 16").log_odds, whole.log_odds);
  EXPECT_EQ(map_of(part_of(training_, 5, 20)).log_odds, selected.log_odds);
  write_recording(folder_ / "first.h5", part_of(training_, 0, 30));
  write_recording(folder_ / "second.h5", part_of(training_, 30, 48));
  done("map first.h5 second.h5 -o both.map.h5");
  EXPECT_EQ(read_map(folder_ / "both.map.h5").log_odds, whole.log_odds);
}

TEST_F(MapCommand, RefusesTouchesBeyondAnyRobotBeforeAnythingIsWritten) {
  for (const auto& [x_mm, prior] : {std::pair{1e300, "auto"}, {-1.1e9, "0.2"}}) {
    training_.T_robot_sensor[7].translation_mm.x = x_mm;
    write_recording(folder_ / "A.h5", training_);
    expect_refused(std::string("map I.h5 A.h5 -o new/ --png maps.png --prior ") + prior,
                   {"A.h5: sensor_pose[7]", "within 1e+09 mm", "unit"});
  }
}

TEST_F(MapCommand, RefusesTheLabelOfObjectsThatWereNeverLearned) {
  expect_refused("map A.h5 -o new/ --label (none)", {"--label (none)", "choose"});
  training_.object = "(none)";
  write_recording(folder_ / "A.h5", training_);
  expect_refused("map A.h5 -o new/", {"A.h5", "'(none)'", "--label"});
  EXPECT_EQ(map_of_a("--label A").label, "A");
}

}  // namespace palpate::map_test
