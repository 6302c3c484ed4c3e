#include "learning/observed_map.hpp"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/errors.hpp"
#include "support/limits.hpp"
#include "support/shared_device.hpp"
#include "support/synthetic.hpp"

namespace palpate::observed_map_test {

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

TEST(ObservedMap, HasTheEvidenceOfTheMethod) {
  const Recording recording = random_recording(5, 40, 7);
  const std::vector<Touch> touches = all_touches(recording);
  const MapOptions options{.cell_mm = 0.75, .sensor = {.spread_mm = 0.8, .prior = 0.1}};
  const OccupancyGrid map = observed_map(touches, options, "A");
  EXPECT_LT(map_error(map, touches, options), 1e-3);
  EXPECT_EQ(map.label, "A");
  EXPECT_EQ(map.prior, 0.1);
  EXPECT_EQ(map.spread_mm, 0.8);
}

TEST(ObservedMap, HasTheCellsOfMapBuilder) {
  const Recording recording = random_recording(3, 20, 8);
  MapBuilder builder(shared_device(), {});
  builder.add(all_touches(recording));
  const OccupancyGrid expected = builder.build("A");
  const OccupancyGrid map = observed_map(all_touches(recording), {}, "A");
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

}  // namespace palpate::observed_map_test
