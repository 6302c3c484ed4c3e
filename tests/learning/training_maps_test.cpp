#include "learning/press.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "learning/observed_map.hpp"
#include "learning/press_placement.hpp"
#include "simulated_presses.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"
#include "support/shared_device.hpp"
#include "support/synthetic.hpp"

namespace palpate::training_maps_test {

/// Touches of a shape, which has this label.
Recording touched(const Silhouette& shape, const std::string& label, std::size_t touches) {
  Recording recording = touches_of(shape, Pose{}, touches, 8);
  recording.object = label;
  return recording;
}

TEST(TrainingMaps, HoldThePressesOfTheOtherFolds) {
  const Recording l = touched(on_letter_l, "L", 4);
  const Recording disc = touched(on_disc, "disc", 3);
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

TEST(TrainingMaps, OfTouchesThatSayNothingAreRefusedByObjectOrPress) {
  Recording recording = touched(on_disc, "disc", 4);
  recording.valid.assign(36, 0);
  EXPECT_TRUE(input_error([&] {
                maps_by_folds(posed_presses(recording), map_options(), 2);
              }).starts_with("disc: "));
  SimulatedPresses simulated;
  simulated.add(on_disc, "disc", 2, 8);
  simulated.recordings[1].valid.assign(196, 0);
  simulated.presses[1] = single_press(simulated.recordings[1], 0);
  expect_named(input_error([&] { maps_of_presses(simulated.presses, map_options()); }),
               {"disc1.h5, touch 0"});
}

TEST(Presses, LieAboutTheOriginOfTheirFrameOrWhereTheRecordingSays) {
  Recording recording = random_recording(3, 12, 7);
  recording.path = "file.h5";
  const Press single = single_press(recording, 1);
  EXPECT_EQ(single.name, "file.h5, touch 1");
  ASSERT_EQ(single.touches.size(), 1U);
  const Pose& at = single.touches[0].T_robot_sensor;
  EXPECT_LT(glm::length(at * array_centre_mm(recording.elements_mm)), 1e-12);
  EXPECT_EQ(at.theta_rad, 0.0);
  EXPECT_FALSE(single.T_object_robot.has_value());
  for (std::size_t touch = 0; touch < 3; ++touch) {
    const Press posed = posed_press(recording, touch);
    ASSERT_EQ(posed.touches.size(), 1U);
    const Pose T_object_sensor = posed.T_object_robot.value() * posed.touches[0].T_robot_sensor;
    for (const glm::dvec2 point : {glm::dvec2{0.0, 0.0}, glm::dvec2{3.0, 1.0}}) {
      EXPECT_LT(glm::distance(T_object_sensor * point, recording.T_robot_sensor[touch] * point),
                1e-12);
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

using Folds = std::vector<std::size_t>;

/// The folds of presses of these labels and groups.
Folds folds(const std::vector<std::pair<const char*, const char*>>& of, std::size_t count) {
  std::vector<Press> presses;
  for (const auto& [label, group] : of) {
    presses.push_back({.name = "", .label = label, .touches = {}, .group = group});
  }
  return folds_of(presses, count);
}

TEST(Presses, OfAGroupAreInOneFoldAndAnObjectsGroupsInDifferentOnes) {
  // Whoever touched two objects is left out of both.
  EXPECT_EQ(folds({{"A", "a"}, {"A", "a"}, {"A", "b"}, {"B", "b"}, {"B", "a"}, {"A", "b"}}, 5),
            (Folds{0, 0, 1, 1, 0, 1}));
  // A recording is of one object: as many folds as there are, and the emptiest next.
  EXPECT_EQ(folds({{"A", "1"}, {"A", "2"}, {"B", "3"}, {"B", "4"}}, 5), (Folds{0, 1, 2, 3}));
  EXPECT_EQ(folds({{"A", "1"}, {"A", "1"}, {"A", "2"}, {"B", "3"}, {"B", "4"}, {"A", "5"}}, 2),
            (Folds{0, 0, 1, 1, 0, 1}));
  // One group tells of no other.
  EXPECT_EQ(folds({{"A", "a"}, {"A", "a"}}, 2), (Folds{0, 1}));
}

TEST(GroupedObject, IsNamedByTheRecordingOrItsLabel) {
  Recording recording{.path = "day1/cup.h5", .object = "red@cup@anna"};
  for (const auto& [by, label, group] : {std::tuple{"", "red@cup@anna", ""},
                                         {"recording", "red@cup@anna", "day1/cup.h5"},
                                         {"label", "red@cup", "anna"}}) {
    EXPECT_EQ(grouped_object(recording, by).label, label);
    EXPECT_EQ(grouped_object(recording, by).group, group);
  }
  EXPECT_THROW(grouped_object(recording, "day"), Error);
  for (const char* object : {"cup", "@anna", "cup@", ""}) {
    recording.object = object;
    EXPECT_THROW(grouped_object(recording, "label"), Error) << object;
  }
}

TEST(PlacingLattice, IsAsWideAsTheShorterSideOfTheBoxAroundAllMaps) {
  std::vector<TrainingMap> maps(2);
  maps[0].map = {.cell_mm = 1.0, .origin_mm = {-10.0, 0.0}, .nx = 21, .ny = 5};
  maps[1].map = {.cell_mm = 1.0, .origin_mm = {0.0, -6.0}, .nx = 3, .ny = 7};
  for (TrainingMap& each : maps) {
    each.map.log_odds.assign(static_cast<std::size_t>(each.map.nx * each.map.ny), 0.0F);
  }
  const PoseLattice lattice = placing_lattice(maps, 2.0, 0.3);
  // Together x from -10 to 10, y from -6 to 4.
  const auto& [x, y, theta, pivot_mm] = lattice;
  EXPECT_NEAR(x.upper - x.lower, 10.0, 2.0);
  EXPECT_NEAR(x.upper - x.lower, y.upper - y.lower, 1e-12);
  EXPECT_NEAR((x.upper + x.lower) / 2.0 + pivot_mm.x, 0.0, 1e-9);
  EXPECT_NEAR((y.upper + y.lower) / 2.0 + pivot_mm.y, -1.0, 1e-9);
  EXPECT_LE(x.step(), 2.0);
  EXPECT_LE(theta.step(), 0.3);
  EXPECT_TRUE(lattice.full_circle());
}

/// One touch of a row of elements 2 mm apart, the first at (0, 0).
Recording row_of(std::vector<double> pressure) {
  Recording recording{.T_robot_sensor = {Pose{}}, .pressure = std::move(pressure)};
  for (std::size_t e = 0; e < recording.pressure.size(); ++e) {
    recording.elements_mm.emplace_back(2.0 * static_cast<double>(e), 0.0);
  }
  return recording;
}

/// Index of the cell centred at a place.
std::size_t cell_at(const OccupancyGrid& map, double x_mm, double y_mm) {
  const auto i = static_cast<int>(std::lround((x_mm - map.origin_mm.x) / map.cell_mm));
  const auto j = static_cast<int>(std::lround((y_mm - map.origin_mm.y) / map.cell_mm));
  return static_cast<std::size_t>(j) * map.nx + i;
}

TEST(ObservedMap, HasTheEvidenceOfTheMethodInTheCellsOfMapBuilder) {
  const Recording recording = random_recording(5, 40, 7);
  const std::vector<Touch> touches = all_touches(recording);
  const MapOptions options{.cell_mm = 0.75, .sensor = {.spread_mm = 0.8, .prior = 0.1}};
  const OccupancyGrid map = observed_map(touches, options, "A");
  EXPECT_LT(map_error(map, touches, options), 1e-3);
  EXPECT_EQ(map.label, "A");
  EXPECT_EQ(map.prior, 0.1);
  EXPECT_EQ(map.spread_mm, 0.8);
  MapBuilder builder(shared_device(), options);
  builder.add(touches);
  const OccupancyGrid expected = builder.build("A");
  EXPECT_EQ(map.origin_mm, expected.origin_mm);
  EXPECT_EQ(map.nx, expected.nx);
  EXPECT_EQ(map.ny, expected.ny);
}

TEST(ObservedMap, CountsTouchesWithinOneSpacing) {
  // The last element is Unknown (between the threshold and the ratio), the middle one dead.
  Recording recording = row_of({10.0, 0.0, 0.0, 0.0, 2.5});
  recording.valid = {1, 1, 0, 1, 1};
  const OccupancyGrid map =
      observed_map(std::vector(2, recording.touch(0)), {.cell_mm = 0.5}, "row");
  const auto counted = [&](double x_mm, double y_mm) {
    return map.observations[cell_at(map, x_mm, y_mm)];
  };
  EXPECT_EQ(counted(0.0, 0.0), 2.0F);
  EXPECT_EQ(counted(0.0, 2.0), 2.0F);
  EXPECT_EQ(counted(0.0, 2.5), 0.0F);
  EXPECT_EQ(counted(4.0, 0.0), 2.0F) << "dead, but beside a known element";
  EXPECT_EQ(counted(8.0, 0.0), 2.0F) << "Unknown, beside a known element";
  EXPECT_EQ(counted(8.5, 0.0), 0.0F);

  const OccupancyGrid dot =
      observed_map(all_touches(row_of({5.0})), {.cell_mm = 0.5, .sensor = {.spread_mm = 0.5}}, "");
  EXPECT_EQ(dot.observations[cell_at(dot, 1.0, 0.0)], 1.0F) << "one element has the spread alone";
  EXPECT_EQ(dot.observations[cell_at(dot, 1.5, 0.0)], 0.0F);
  EXPECT_NEAR(dot.mean_level[cell_at(dot, 1.0, 0.0)], 5.0, 1e-6);
}

TEST(ObservedMap, AveragesPressuresAroundACell) {
  Recording first = row_of({8.0, 4.0, -3.0});
  const Recording second = row_of({0.0, 6.0, 0.0});
  const MapOptions options{.cell_mm = 1.0, .sensor = {.spread_mm = 1.0}};
  const OccupancyGrid map =
      observed_map(std::vector{first.touch(0), second.touch(0)}, options, "row");
  const auto g = [](double mm) { return std::exp(-0.5 * mm * mm); };
  // At (0, 0) elements at 0, 2 and 4 mm; four deviations are 4 mm.
  const double all = g(0) + g(2) + g(4);
  EXPECT_NEAR(map.mean_level[cell_at(map, 0.0, 0.0)],
              ((8.0 * g(0) + 4.0 * g(2)) / all + 6.0 * g(2) / all) / 2.0, 1e-5);
  const double side = g(std::sqrt(2.0));
  EXPECT_NEAR(map.mean_level[cell_at(map, 1.0, 1.0)],
              ((8.0 + 4.0) + 6.0) * side / (2.0 * side + g(std::sqrt(10.0))) / 2.0, 1e-5);
  EXPECT_EQ(map.mean_level[cell_at(map, 0.0, 3.0)], 0.0F) << "not sensed";

  // A dead element's pressure, and one that is no number, take no part.
  first.valid = {1, 0, 1};
  first.pressure = {8.0, 1000.0, nan};
  const OccupancyGrid alone = observed_map(all_touches(first), options, "row");
  EXPECT_NEAR(alone.mean_level[cell_at(alone, 1.0, 1.0)], 8.0, 1e-5);
}

TEST(ObservedMap, MovesWithTheTouch) {
  const Recording recording = random_recording(1, 30, 9);
  const Recording turned = moved(recording, {{4.0, -7.0}, two_pi / 4.0});
  const OccupancyGrid map = observed_map(all_touches(recording), {.cell_mm = 1.0}, "A");
  const OccupancyGrid other = observed_map(all_touches(turned), {.cell_mm = 1.0}, "A");
  for (int j = 0; j < map.ny; ++j) {
    for (int i = 0; i < map.nx; ++i) {
      const glm::dvec2 place = map.centre_mm(i, j);
      const std::size_t k = static_cast<std::size_t>(j) * map.nx + i;
      if (map.observations[k] > 0.0F) {
        const std::size_t there = cell_at(other, 4.0 - place.y, -7.0 + place.x);
        EXPECT_EQ(other.observations[there], 1.0F);
        EXPECT_NEAR(other.mean_level[there], map.mean_level[k], 1e-4);
      }
    }
  }
}

TEST(ObservedMap, RefusesTouchesThatSayNothing) {
  const Recording silent = row_of({2.0, 2.0});  // at the threshold: Unknown
  expect_named(input_error([&] { observed_map(all_touches(silent), {}, "A"); }), {"object 'A'"});
  EXPECT_THROW(observed_map({}, {}, "A"), Error);
  const Recording pressed = row_of({9.0, 0.0});
  for (const MapOptions& options :
       {MapOptions{.cell_mm = 0.0}, MapOptions{.sensor = {.prior = 0.0}}}) {
    EXPECT_THROW(observed_map(all_touches(pressed), options, "A"), Error);
  }
}

}  // namespace palpate::training_maps_test
