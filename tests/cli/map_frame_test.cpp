// Where the object frame of a map lies, and maps that were learned on different days.

#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include "palpate/map_builder.hpp"
#include "palpate/object_frame.hpp"
#include "palpate/pose_error.hpp"
#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::map_frame_test {

using nlohmann::json;

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
  OccupancyGrid bare = map;
  bare.source.reset();
  expect_named(input_error([&] { with_prior(device, bare, 0.3); }), {"holds no touches"});
}

}  // namespace palpate::map_frame_test
