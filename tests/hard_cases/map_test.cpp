#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "hard_case.hpp"
#include "support/errors.hpp"

namespace palpate::map_test {

TEST(Map, TwoHundredThousandTouchesOfOneSpot) {
  HardCase hard("a map of 2e5 touches of one spot, and recognition with it");
  constexpr int times = sanitized ? 20'000 : 200'000;
  Recording spot;
  spot.T_robot_sensor.push_back({{3.3, -2.1}, 0.7});
  spot.elements_mm = {{0.0, 0.0}, {1.9, 0.0}};
  spot.pressure = {10.0, 0.5};
  const MapOptions options;
  MapBuilder builder(hard.device(), options);
  const std::vector<Touch> touches(10'000, spot.touch(0));
  for (int i = 0; i < times / 10'000; ++i) {
    builder.add(touches);
  }
  const OccupancyGrid map = builder.build("spot");
  const std::vector<double> once =
      reference::log_odds_map(all_touches(spot), map, options.classifier, options.sensor);
  double most = 0.0;
  for (std::size_t cell = 0; cell < once.size(); ++cell) {
    const double prior = map.prior_log_odds();
    const double expected = prior + times * (once[cell] - prior);
    hard.expect_cell(map.log_odds[cell], expected);
    most = std::max(most, std::abs(expected));
  }
  EXPECT_GT(most, 1.5 * times) << "not the steep map that is wanted";

  const std::vector<Hypothesis> objects{{map, 1.0}, {random_map(31, 27, 0.5, 6.0, 491), 1.0}};
  for (const double gamma : {0.1, 0.0}) {
    HistogramOptions recognition{.contact = {.gamma = gamma}};
    recognition.lattice = {
        .x_mm = {-3.0, 3.0, 5}, .y_mm = {-3.0, 3.0, 5}, .theta_rad = {0.0, 0.5, 3}};
    // Interpolation keeps seven digits of millions of nats. With gamma, this error matters only
    // where the likelihood is steep, in a strip of 1e-6 cells.
    hard.expect_posterior(
        objects, recognition, all_touches(spot),
        {.nats = gamma > 0.0 ? 1e-4 : 0.3, .relative = 3e-7, .near_top_nats = 2e-5});
  }
}

TEST(Map, FarFromTheRobotsOrigin) {
  HardCase hard("a map 1e6 mm from the robot's origin, of angles of 1e6 turns");
  const Recording near = random_recording(3, 36, 492);
  Recording far = moved(near, {{1e6, -1e6}, 0.0});
  for (Pose& pose : far.T_robot_sensor) {
    pose.theta_rad += 1e6 * two_pi;
  }
  const OccupancyGrid map = hard.expect_map(all_touches(far), {});
  EXPECT_EQ(std::round(map.origin_mm.x / map.cell_mm) * map.cell_mm, map.origin_mm.x);
  const OccupancyGrid at_origin = hard.expect_map(all_touches(near), {});
  EXPECT_EQ(map.nx, at_origin.nx);
  EXPECT_EQ(map.ny, at_origin.ny);
}

TEST(Map, OfOneCell) {
  HardCase hard("a map of one cell, larger than the support of all readings");
  Recording recording = random_recording(1, 4, 493);
  // The nearest cell's centre lies 30 mm away, then among the readings.
  for (const double x_mm : {30.0, 0.0}) {
    recording.T_robot_sensor[0] = {{x_mm, 0.0}, 0.0};
    const OccupancyGrid map = hard.expect_map(all_touches(recording), {.cell_mm = 100.0});
    EXPECT_EQ(map.nx * map.ny, 1);
    const std::vector<Hypothesis> objects{{map, 1.0}};
    HistogramOptions options;
    options.lattice = {.x_mm = {-60.0, 60.0, 6}, .y_mm = {-60.0, 60.0, 5}, .theta_rad = {0, 6, 3}};
    hard.expect_posterior(objects, options, all_touches(recording));
  }
}

TEST(Map, CellsOfTwoHundredthsOfAMillimetre) {
  HardCase hard("a map in cells of 0.02 mm");
  Recording recording = random_recording(1, 4, 494);
  for (glm::dvec2& element : recording.elements_mm) {
    element *= 0.2;
  }
  const OccupancyGrid map = hard.expect_map(all_touches(recording), {.cell_mm = 0.02});
  EXPECT_GT(map.nx * map.ny, 50'000);
}

TEST(Map, CellsOfAHundredMillimetres) {
  HardCase hard("a map in cells of 100 mm, and touches 1 m apart");
  Recording recording = random_recording(60, 36, 495);
  Uniform random(496);
  for (Pose& pose : recording.T_robot_sensor) {
    // Touches lie around the centres of cells: elsewhere, they would change no cell.
    pose.translation_mm = {100.0 * std::floor(random(-8.0, 9.0)),
                           100.0 * std::floor(random(-8.0, 9.0))};
  }
  // Cells that are 200, 20 and 2 spreads wide.
  for (const double spread_mm : {0.5, 5.0, 50.0}) {
    MapOptions options{.cell_mm = 100.0};
    options.sensor.spread_mm = spread_mm;
    hard.expect_map(all_touches(recording), options);
  }
}

TEST(Map, PriorsAndPeaksAtTheirEnds) {
  HardCase hard("a map with a prior of 1e-6 or 1 - 1e-6, and with a peak of 0.9999");
  Recording recording = random_recording(2, 36, 497);
  // At the centre of a cell, where the weight has its peak.
  recording.T_robot_sensor[0] = {};
  recording.elements_mm[0] = {1.0, 1.0};
  for (const double prior : {1e-6, 1.0 - 1e-6}) {
    for (const double peak : {0.9, 0.9999}) {
      MapOptions options;
      options.sensor = {.peak = peak, .prior = prior};
      hard.expect_map(all_touches(recording), options);
      // Many equal readings, whose errors add up.
      const std::vector<Touch> many(200, recording.touch(0));
      hard.expect_map(many, {.cell_mm = 2.0, .sensor = options.sensor});
    }
  }
  // What lies a little beyond is refused.
  for (const auto& [peak, prior, named] :
       {std::tuple(0.9, 1e-7, "prior"), {0.9, 1.0 - 1e-7, "prior"}, {0.99999, 0.2, "peak"}}) {
    const MapOptions options{.sensor = {.peak = peak, .prior = prior}};
    expect_named(input_error([&] { MapBuilder(hard.device(), options); }), {named});
  }
}

}  // namespace palpate::map_test
