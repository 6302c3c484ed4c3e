#include "learning/training_maps.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "learning/observed_map.hpp"
#include "learning/press_placement.hpp"
#include "palpate/error.hpp"
#include "simulated_presses.hpp"
#include "support/synthetic.hpp"

namespace palpate::training_maps_test {

MapOptions map_options() { return {.cell_mm = 0.75, .sensor = {.spread_mm = 0.75, .prior = 0.2}}; }

TEST(TrainingMaps, HoldThePressesOfTheOtherFolds) {
  Recording l = touches_of(on_letter_l, Pose{}, 4, 8);
  l.object = "L";
  Recording disc = touches_of(on_disc, Pose{}, 3, 9);
  disc.object = "disc";
  std::vector<Press> presses = posed_presses(l);
  std::ranges::copy(posed_presses(disc), std::back_inserter(presses));
  const std::vector<TrainingMap> maps = maps_by_folds(presses, map_options(), 3).without_folds;
  std::map<std::string, std::vector<std::vector<std::size_t>>> held;
  for (const TrainingMap& map : maps) {
    held[map.map.label].push_back(map.presses);
  }
  EXPECT_EQ(held["L"], (std::vector<std::vector<std::size_t>>{{1, 2}, {0, 2, 3}, {0, 1, 3}}));
  EXPECT_EQ(held["disc"], (std::vector<std::vector<std::size_t>>{{5, 6}, {4, 6}, {4, 5}}));
  EXPECT_TRUE(maps[0].holds(1));
  EXPECT_FALSE(maps[0].holds(3));
  // In the object frame, whatever the frame of the presses.
  const OccupancyGrid expected =
      observed_map(std::vector<Touch>{l.touch(1), l.touch(2)}, map_options(), "L");
  EXPECT_EQ(maps[0].map.origin_mm, expected.origin_mm);
  ASSERT_EQ(maps[0].map.log_odds.size(), expected.log_odds.size());
  for (std::size_t k = 0; k < expected.log_odds.size(); ++k) {
    EXPECT_NEAR(maps[0].map.log_odds[k], expected.log_odds[k], 1e-4);
  }
}

TEST(TrainingMaps, OfTouchesThatSayNothingAreRefusedByObject) {
  Recording recording = touches_of(on_disc, Pose{}, 4, 9);
  recording.object = "disc";
  recording.valid.assign(36, 0);
  try {
    maps_by_folds(posed_presses(recording), map_options(), 2).without_folds;
    FAIL() << "touches of dead elements were mapped";
  } catch (const Error& error) {
    EXPECT_TRUE(std::string(error.what()).starts_with("disc: ")) << error.what();
  }
}

TEST(TrainingMaps, OfPressesAreOfOneEach) {
  SimulatedPresses simulated;
  simulated.add_shapes(2, 10);
  const std::vector<TrainingMap> maps = maps_of_presses(simulated.presses, map_options());
  ASSERT_EQ(maps.size(), 4U);
  for (std::size_t i = 0; i < maps.size(); ++i) {
    EXPECT_EQ(maps[i].presses, std::vector<std::size_t>{i});
    EXPECT_EQ(maps[i].map.label, simulated.presses[i].label);
  }
  EXPECT_FALSE(TrainingMap{}.holds(0)) << "a map from elsewhere";
}

TEST(Presses, LieAboutTheOriginOfTheirFrame) {
  Recording recording = random_recording(3, 12, 7);
  recording.path = "file.h5";
  const Press single = single_press(recording, 1);
  EXPECT_EQ(single.name, "file.h5, touch 1");
  ASSERT_EQ(single.touches.size(), 1U);
  const glm::dvec2 middle =
      single.touches[0].T_robot_sensor * array_centre_mm(recording.elements_mm);
  EXPECT_NEAR(middle.x, 0.0, 1e-12);
  EXPECT_NEAR(middle.y, 0.0, 1e-12);
  EXPECT_FALSE(single.T_object_robot.has_value());
  EXPECT_EQ(single.touches[0].T_robot_sensor.theta_rad, 0.0);
}

TEST(Presses, AtKnownPosesAreWhereTheRecordingSays) {
  const Recording recording = random_recording(3, 12, 7);
  for (std::size_t touch = 0; touch < 3; ++touch) {
    const Press posed = posed_press(recording, touch);
    ASSERT_EQ(posed.touches.size(), 1U);
    ASSERT_TRUE(posed.T_object_robot.has_value());
    const Pose T_object_sensor = *posed.T_object_robot * posed.touches[0].T_robot_sensor;
    const Pose& expected = recording.T_robot_sensor[touch];
    for (const glm::dvec2 point : {glm::dvec2{0.0, 0.0}, glm::dvec2{3.0, 1.0}}) {
      EXPECT_NEAR((T_object_sensor * point).x, (expected * point).x, 1e-12);
      EXPECT_NEAR((T_object_sensor * point).y, (expected * point).y, 1e-12);
    }
  }
}

TEST(Presses, AtKnownPosesTakeTurnsInFoldsAndOthersShareThemWithTheirNeighbours) {
  SimulatedPresses simulated;
  simulated.add_shapes(3, 11);
  EXPECT_EQ(folds_of(simulated.presses, 2), (std::vector<std::size_t>{0, 0, 1, 0, 0, 1}));
  EXPECT_EQ(folds_of(simulated.presses, 5), (std::vector<std::size_t>{0, 1, 3, 0, 1, 3}));
  for (Press& press : simulated.presses) {
    press.T_object_robot = Pose{};
  }
  EXPECT_EQ(folds_of(simulated.presses, 2), (std::vector<std::size_t>{0, 1, 0, 0, 1, 0}));
}

std::vector<Press> grouped(const std::vector<std::pair<std::string, std::string>>& of) {
  std::vector<Press> presses;
  for (const auto& [label, group] : of) {
    presses.push_back({.name = "", .label = label, .touches = {}, .group = group});
  }
  return presses;
}

TEST(Presses, OfAGroupAreInOneFoldAndAnObjectsGroupsInDifferentOnes) {
  using Folds = std::vector<std::size_t>;
  // Whoever touched two objects is left out of both.
  EXPECT_EQ(folds_of(grouped({{"A", "anna"},
                              {"A", "anna"},
                              {"A", "ben"},
                              {"B", "ben"},
                              {"B", "anna"},
                              {"A", "ben"}}),
                     5),
            (Folds{0, 0, 1, 1, 0, 1}));
  // A recording is of one object: as many folds as there are, and the emptiest next.
  EXPECT_EQ(folds_of(grouped({{"A", "1"}, {"A", "2"}, {"B", "3"}, {"B", "4"}}), 5),
            (Folds{0, 1, 2, 3}));
  EXPECT_EQ(
      folds_of(grouped({{"A", "1"}, {"A", "1"}, {"A", "2"}, {"B", "3"}, {"B", "4"}, {"A", "5"}}),
               2),
      (Folds{0, 0, 1, 1, 0, 1}));
  // One group tells of no other.
  EXPECT_EQ(folds_of(grouped({{"A", "anna"}, {"A", "anna"}}), 2), (Folds{0, 1}));
}

TEST(GroupedObject, IsNamedByTheRecordingOrItsLabel) {
  Recording recording{.path = "day1/cup.h5", .object = "red@cup@anna"};
  EXPECT_EQ(grouped_object(recording, "").label, "red@cup@anna");
  EXPECT_EQ(grouped_object(recording, "").group, "");
  EXPECT_EQ(grouped_object(recording, "recording").label, "red@cup@anna");
  EXPECT_EQ(grouped_object(recording, "recording").group, "day1/cup.h5");
  EXPECT_EQ(grouped_object(recording, "label").label, "red@cup");
  EXPECT_EQ(grouped_object(recording, "label").group, "anna");
  EXPECT_THROW(grouped_object(recording, "day"), Error);
  for (const char* object : {"cup", "@anna", "cup@", ""}) {
    recording.object = object;
    EXPECT_THROW(grouped_object(recording, "label"), Error) << object;
  }
}

TEST(PlacingLattice, IsAsWideAsTheShorterSideOfTheBoxAroundAllMaps) {
  TrainingMap wide;
  wide.map = {.cell_mm = 1.0, .origin_mm = {-10.0, 0.0}, .nx = 21, .ny = 5};
  wide.map.log_odds.assign(105, 0.0F);
  TrainingMap high;
  high.map = {.cell_mm = 1.0, .origin_mm = {0.0, -6.0}, .nx = 3, .ny = 7};
  high.map.log_odds.assign(21, 0.0F);
  const PoseLattice lattice = placing_lattice(std::vector{wide, high}, 2.0, 0.3);
  // Together x from -10 to 10, y from -6 to 4.
  EXPECT_NEAR(lattice.x_mm.upper - lattice.x_mm.lower, 10.0, 2.0);
  EXPECT_NEAR(lattice.x_mm.upper - lattice.x_mm.lower, lattice.y_mm.upper - lattice.y_mm.lower,
              1e-12);
  EXPECT_NEAR((lattice.x_mm.upper + lattice.x_mm.lower) / 2.0 + lattice.pivot_mm.x, 0.0, 1e-9);
  EXPECT_NEAR((lattice.y_mm.upper + lattice.y_mm.lower) / 2.0 + lattice.pivot_mm.y, -1.0, 1e-9);
  EXPECT_LE(lattice.x_mm.step(), 2.0);
  EXPECT_LE(lattice.theta_rad.step(), 0.3);
  EXPECT_TRUE(lattice.full_circle());
}

TEST(Presses, ThatSayNothingAreRefusedByName) {
  SimulatedPresses simulated;
  simulated.add(on_disc, "disc", 2, 8);
  simulated.recordings[1].valid.assign(196, 0);
  simulated.presses[1] = single_press(simulated.recordings[1], 0);
  try {
    maps_of_presses(simulated.presses, map_options());
    FAIL() << "a press of dead elements was mapped";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("disc1.h5, touch 0"), std::string::npos);
  }
}

}  // namespace palpate::training_maps_test
