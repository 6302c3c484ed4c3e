#include "learning/unposed_maps.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/simulation.hpp"
#include "support/errors.hpp"
#include "support/sample_files.hpp"
#include "support/synthetic.hpp"

namespace palpate::unposed_maps_test {

UnposedOptions usual_options(std::size_t most_maps) {
  UnposedOptions options;
  options.map.cell_mm = 1.0;
  options.map.sensor.spread_mm = 1.2;
  options.contact.prior = options.map.sensor.prior;
  options.most_maps = most_maps;
  return options;
}

/// Intersection over union of the map's occupied cells and the shape, at the pose of the map's
/// frame that one of its presses says, whichever agrees best.
double overlap(const UnposedMap& map, const Recording& recording, const Shape& shape) {
  double best = 0.0;
  for (const PlacedPress& press : map.presses) {
    const Pose T_shape_map = recording.T_robot_sensor[press.press] * inverse(press.T_object_sensor);
    double both = 0.0;
    double either = 0.0;
    for (int j = 0; j < map.map.ny; ++j) {
      for (int i = 0; i < map.map.nx; ++i) {
        const bool occupied = map.map.at(i, j) > 0.0F;
        const bool on_shape = shape.contains(T_shape_map * map.map.centre_mm(i, j));
        both += occupied && on_shape ? 1.0 : 0.0;
        either += occupied || on_shape ? 1.0 : 0.0;
      }
    }
    best = std::max(best, both / either);
  }
  return best;
}

std::vector<std::size_t> presses_in(const UnposedMap& map) {
  std::vector<std::size_t> presses;
  for (const PlacedPress& press : map.presses) {
    presses.push_back(press.press);
  }
  return presses;
}

TEST(UnposedMaps, PressesOfALetterFuseIntoItsShapeWhateverPosesTheySay) {
  for (const std::string letter : {"A", "U", "E"}) {
    const Recording recording = sample_presses(letter, 10, 3);
    const UnposedMaps result = unposed_maps(all_touches(recording), letter, usual_options(1));
    ASSERT_EQ(result.maps.size(), 1u);
    EXPECT_TRUE(result.misfits.empty()) << letter;
    EXPECT_TRUE(result.settled) << letter;
    EXPECT_EQ(result.maps[0].map.label, letter);
    EXPECT_EQ(result.maps[0].presses.size(), 10u) << letter;
    // Measured: 0.68 for the U, above 0.7 for the others.
    EXPECT_GT(overlap(result.maps[0], recording, make_shape(letter)), 0.6) << letter;
  }
  Recording a = sample_presses("A", 5, 13);
  const OccupancyGrid before = unposed_maps(all_touches(a), "A", usual_options(1)).maps[0].map;
  std::ranges::fill(a.T_robot_sensor, Pose{{1000.0, -7.0}, 1.0});
  EXPECT_EQ(unposed_maps(all_touches(a), "A", usual_options(1)).maps[0].map.log_odds,
            before.log_odds);
}

TEST(UnposedMaps, PressesThatFitAtEveryAngleCountLess) {
  const Recording recording = sample_presses("ring", 6, 8);
  const UnposedMaps result = unposed_maps(all_touches(recording), "ring", usual_options(1));
  for (const PlacedPress& press : result.maps.at(0).presses) {
    EXPECT_LT(press.weight, 0.4);
    EXPECT_GT(press.weight, 0.05);
  }
}

TEST(UnposedMaps, MirroredPressesJoinWhereTheObjectMayLieOnItsOtherSide) {
  // A J is far from its mirror image at every turn, as blurred as the array sees it.
  Recording mixed = sample_presses("J", 8, 12);
  constexpr std::ptrdiff_t side = 16;
  for (auto row = mixed.pressure.begin() + 4 * side * side; row != mixed.pressure.end();
       row += side) {
    std::reverse(row, row + side);
  }
  UnposedOptions options = usual_options(1);
  options.mirror = true;
  const UnposedMaps result = unposed_maps(all_touches(mixed), "J", options);
  ASSERT_EQ(result.maps.size(), 1u);
  EXPECT_TRUE(result.misfits.empty());
  EXPECT_TRUE(result.maps[0].map.mirror);
  ASSERT_EQ(result.maps[0].presses.size(), 8u);
  for (const PlacedPress& press : result.maps[0].presses) {
    EXPECT_EQ(press.mirrored, result.maps[0].presses[0].mirrored != (press.press >= 4))
        << press.press;
  }
  const UnposedMaps straight = unposed_maps(all_touches(mixed), "J", usual_options(2));
  ASSERT_EQ(straight.maps.size(), 2u) << "without a mirror, each side is an object of its own";
  for (const UnposedMap& map : straight.maps) {
    const bool turned = map.presses.at(0).press >= 4;
    EXPECT_EQ(presses_in(map), turned ? (std::vector<std::size_t>{4, 5, 6, 7})
                                      : (std::vector<std::size_t>{0, 1, 2, 3}));
  }
}

TEST(UnposedMaps, TakesLearnedTablesOverTheirLayer) {
  const Recording a = sample_presses("A", 6, 14);
  const Recording o = sample_presses("ring", 1, 15);
  std::vector<Touch> presses = all_touches(a);
  presses.push_back(o.touch(0));
  UnposedOptions options = usual_options(1);
  options.layer = ReadingLayer{.of = MapLayer::mean_level, .full_level = 40.0};
  LikelihoodTable table{.first_log_odds = ReadingLayer::first_node,
                        .last_log_odds = ReadingLayer::largest_value,
                        .nodes = ReadingLayer::nodes};
  // In Contact with a probability of 0.95 from a third of the full level on, 0.05 below it and 0.2
  // where nothing was sensed.
  for (const bool contact : {false, true}) {
    for (int node = 0; node < ReadingLayer::nodes; ++node) {
      const double value = ReadingLayer::first_node + 0.5 * node;
      const double p = value < -ReadingLayer::largest_value ? 0.2 : value < 2.0 ? 0.05 : 0.95;
      table.log_likelihood.push_back(std::log(contact ? p : 1.0 - p));
    }
  }
  options.contact.table = table;
  const UnposedMaps result = unposed_maps(presses, "A", options);
  EXPECT_EQ(presses_in(result.maps.at(0)), (std::vector<std::size_t>{0, 1, 2, 3, 4, 5}));
  EXPECT_GT(overlap(result.maps[0], a, make_shape("A")), 0.7);
}

TEST(UnposedMaps, RefusesWhatCannotBePlaced) {
  const Recording a = sample_presses("A", 2, 16);
  Recording nothing = a;
  std::ranges::fill(nothing.pressure, 0.0);
  const std::vector<glm::dvec2> element{{0.0, 0.0}};
  const std::vector<double> pressure{5.0};
  const Touch single{.T_robot_sensor = {}, .elements_mm = element, .pressure = pressure};
  const auto expect_refused = [](const char* named, const std::vector<Touch>& presses) {
    expect_named(input_error([&] { unposed_maps(presses, "A", usual_options(1)); }), {named});
  };
  expect_refused("In Contact", all_touches(nothing));
  expect_refused("several elements", {});
  expect_refused("several elements", {single});
}

/// Presses 0 to 2 are alike, 3 and 4 are, 5 is like none.
FitTable sample_table() {
  return {.columns = {0, 1, 3, 5},
          .fit = {{1.0, 0.9, 0.1, 0.0},
                  {0.8, 1.0, 0.0, 0.0},
                  {0.6, 0.9, 0.1, 0.1},
                  {0.0, 0.1, 1.0, 0.0},
                  {0.1, 0.0, 0.7, 0.2},
                  {0.0, 0.0, 0.0, 1.0}}};
}

TEST(NextMap, IsTheOneThatMostPressesFitUntilAllDo) {
  std::vector<double> best(6, 0.0);
  EXPECT_EQ(next_map(sample_table(), best, 0.5), 1u);
  best = {0.9, 1.0, 0.9, 0.1, 0.0, 0.0};
  EXPECT_EQ(next_map(sample_table(), best, 0.5), 2u);
  best = {0.9, 1.0, 0.9, 1.0, 0.7, 0.0};
  EXPECT_EQ(next_map(sample_table(), best, 0.5), 3u);
  EXPECT_FALSE(next_map(sample_table(), std::vector<double>(6, 0.5), 0.5));
}

}  // namespace palpate::unposed_maps_test
