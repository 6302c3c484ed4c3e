// What `palpate map` makes of touches at known poses: maps, where their frame lies, and maps that
// were learned on different days.

#include <cmath>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "letter_files.hpp"
#include "model/element_spacing.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose_error.hpp"
#include "palpate/simulation.hpp"

namespace palpate::map_test {

using nlohmann::json;

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

/// Where the letters' own frame lies in the robot's.
const Pose there{{600.0, 100.0}, 0.4};

/// The recording as the robot writes it that reaches there.
Recording moved(Recording recording) {
  for (Pose& pose : recording.T_robot_sensor) {
    pose = there * pose;
  }
  if (recording.truth) {
    // An object is learned in the robot frame: T_object_robot is the identity where it was learned.
    recording.truth->T_object_robot = there * recording.truth->T_object_robot * inverse(there);
  }
  return recording;
}

class MapFrame : public ProgramTest {
 protected:
  MapFrame() {
    for (const std::string letter : {"A", "I"}) {
      write_recording(folder_ / (letter + ".h5"), moved(sample_training(letter, 48)));
      write_recording(folder_ / ("u" + letter + ".h5"),
                      moved(sample_unknown(letter, {{3.0, -4.0}, 2.0}, 9)));
    }
    write_recording(folder_ / "near.h5", sample_training("A", 48));
  }

  OccupancyGrid map_with(const std::string& recording, const std::string& flags = "") const {
    out_ = done("map " + recording + " -o one.map.h5 " + flags);
    return read_map(folder_ / "one.map.h5");
  }

  mutable std::string out_;
};

TEST_F(MapFrame, LiesAtTheObjectWhereTheRobotsOriginIsOffTheMap) {
  const OccupancyGrid far = map_with("A.h5");
  const OccupancyGrid robot = map_with("A.h5", "--origin robot");
  const glm::dvec2 middle = body_of(robot).centroid_mm;
  const Pose& frame = far.T_learned_robot_object;
  EXPECT_EQ(frame.theta_rad, 0.0) << "the robot's axes";
  EXPECT_EQ(frame.translation_mm, robot.origin_mm - far.origin_mm);
  EXPECT_EQ(far.origin_mm.x / 0.5, std::round(far.origin_mm.x / 0.5)) << "on a whole cell";
  EXPECT_EQ(far.log_odds, robot.log_odds);
  EXPECT_EQ(robot.T_learned_robot_object.translation_mm, glm::dvec2(0.0));
  // On the cell nearest to the object's middle.
  const glm::dvec2 middle_of_i = body_of(map_with("I.h5")).centroid_mm;
  for (const glm::dvec2& off :
       {frame.translation_mm - middle, body_of(far).centroid_mm, middle_of_i}) {
    EXPECT_LE(std::abs(off.x), 0.25);
    EXPECT_LE(std::abs(off.y), 0.25);
  }

  const OccupancyGrid near = map_with("near.h5");
  EXPECT_EQ(near.T_learned_robot_object.translation_mm, glm::dvec2(0.0));
  expect_named(out_, {"the frame of A is the robot's\n"});
  EXPECT_LT(glm::length(body_of(map_with("near.h5", "--origin centroid")).centroid_mm), 0.5);
  expect_named(out_, {"mm, theta 0.00 deg in the robot frame, at the object's middle\n"});
}

TEST_F(MapFrame, LiesWhereOneSays) {
  // The frame in which the letter was made: the map is as if learned at the robot's origin.
  const OccupancyGrid given = map_with("A.h5", "--origin 600,100,22.918311805232928");
  expect_named(done("info one.map.h5"),
               {"frame             600.000, 100.000 mm, 22.92 deg in the robot frame"});
  const OccupancyGrid near = map_with("near.h5");
  ASSERT_EQ(given.nx, near.nx);
  for (std::size_t k = 0; k < near.log_odds.size(); ++k) {
    EXPECT_NEAR(given.log_odds[k], near.log_odds[k], 1e-3);
  }
  EXPECT_NEAR(given.T_learned_robot_object.theta_rad, 0.4, 1e-12);
  expect_refused("map A.h5 -o x.map.h5 --origin middle",
                 {"--origin middle", "auto, centroid, robot"});
  expect_refused("map A.h5 -o x.map.h5 --origin centroid --unposed",
                 {"--origin centroid", "leave it out"});
}

TEST_F(MapFrame, TellsWhereTheObjectIsToTheRobot) {
  done("map A.h5 I.h5 -o maps/ --sensor-model none");
  for (const std::string letter : {"A", "I"}) {
    SCOPED_TRACE(letter);
    const json r = record("u" + letter + ".h5 --maps maps");
    EXPECT_EQ(r["best"], letter);
    EXPECT_LT(r["refined_error_mm"].get<double>(), 0.6);
    EXPECT_LT(r["refined"]["sd"][0].get<double>(), 1.0) << "of the object, not of a lever of 0.6 m";
    // The object stands where it was learned, moved by the inverse of the truth.
    const OccupancyGrid map = read_map(folder_ / "maps" / (letter + ".map.h5"));
    const Pose moved_by = there * inverse(Pose{{3.0, -4.0}, 2.0}) * inverse(there);
    const glm::dvec2 expected = (moved_by * map.T_learned_robot_object).translation_mm;
    for (const int axis : {0, 1}) {
      EXPECT_NEAR(r["refined"]["T_robot_object"][axis].get<double>(), expected[axis], 1.0);
      EXPECT_NEAR(r["truth"]["T_robot_object"][axis].get<double>(), expected[axis], 1e-9);
    }
  }
}

TEST_F(MapFrame, SymmetryIsOfEveryObjectOrOfSome) {
  done("map A.h5 I.h5 -o maps/ --sensor-model none --symmetry I=2");
  EXPECT_EQ(read_map(folder_ / "maps/I.map.h5").symmetry, 2);
  EXPECT_EQ(read_map(folder_ / "maps/A.map.h5").symmetry, 1);
  expect_named(done("recognize uI.h5 --maps maps --json r.json"),
               {"I looks the same after every 1/2 of a turn: its theta is given from -90 to "
                "90 deg\n"});
  const json r = json::parse(bytes_of(folder_ / "r.json"))[0];
  EXPECT_EQ(r["symmetry"], 2);
  EXPECT_LE(std::abs(r["refined"]["T_robot_object"][2].get<double>()), std::numbers::pi / 2.0);
  expect_refused("map A.h5 I.h5 -o maps/ --symmetry Z=2",
                 {"--symmetry Z=2", "no object is named Z; there are A, I"});
  expect_refused("map I.h5 -o x.map.h5 --symmetry I=2,I=3", {"--symmetry I=2,I=3", "nut=6,key=1"});
}

TEST_F(MapFrame, MapsOfDifferentDaysAreRecognisedAsIfLearnedTogether) {
  done("map A.h5 -o maps/ --sensor-model none");
  done("map I.h5 -o maps/ --sensor-model none");
  done("map A.h5 I.h5 -o together/ --sensor-model none");
  ASSERT_NE(read_map(folder_ / "maps/A.map.h5").prior, read_map(folder_ / "maps/I.map.h5").prior);
  expect_named(remarks("recognize uA.h5 --maps maps --json r.json"), {"the maps' priors differ"});
  json apart = json::parse(bytes_of(folder_ / "r.json")).at(0);
  json together = record("uA.h5 --maps together");
  for (json* r : {&apart, &together}) {
    r->erase("seconds");
    (*r)["mode"].erase("map");
  }
  EXPECT_EQ(apart, together) << "the same bits";
}

TEST_F(MapFrame, TouchesOfUnlikeArraysAreKept) {
  Recording small = sample_training("A", 4);
  for (std::size_t i = 0; i < small.size(); ++i) {
    const auto dropped = small.pressure.begin() + static_cast<std::ptrdiff_t>(30 * i + 30);
    small.pressure.erase(dropped, dropped + 6);
  }
  small.elements_mm.resize(30);
  write_recording(folder_ / "small.h5", small);
  done("map near.h5 small.h5 -o both.map.h5");
  const OccupancyGrid map = read_map(folder_ / "both.map.h5");
  ASSERT_TRUE(map.source);
  EXPECT_EQ(map.source->touches.size(), 52u);
  EXPECT_GT(map.source->left_out.value().sd, 0.0);
  Device device = Device::open();
  EXPECT_EQ(with_prior(device, map, map.prior).log_odds, map.log_odds);
  // By whose prior readings are felt less far, so that they make fewer cells.
  const OccupancyGrid other = with_prior(device, map, 0.5);
  done("map near.h5 small.h5 --prior 0.5 -o half.map.h5");
  const OccupancyGrid half = read_map(folder_ / "half.map.h5");
  ASSERT_LT(half.nx, other.nx);
  const glm::dvec2 from = glm::round((half.origin_mm - other.origin_mm) / map.cell_mm);
  for (int x = 0; x < half.nx; ++x) {
    EXPECT_EQ(other.at(x + static_cast<int>(from.x), half.ny / 2 + static_cast<int>(from.y)),
              half.at(x, half.ny / 2));
  }
  EXPECT_EQ(other.log_odds.front(), 0.0F);
  OccupancyGrid bare = map;
  bare.source.reset();
  expect_named(input_error([&] { with_prior(device, bare, 0.3); }), {"holds no touches"});
}

}  // namespace palpate::map_test
