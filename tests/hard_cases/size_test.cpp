// Cells and arrays of the least and of the largest sizes, of maps as they are built, too.

#include <cmath>

#include <gtest/gtest.h>

#include "hard_case.hpp"
#include "support/errors.hpp"

namespace palpate::size_test {

TEST(Size, CellsOfTwoHundredthsOfAMillimetre) {
  HardCase hard("map cells of 0.02 mm");
  HardCase bounds("bounds: map cells of 0.02 mm, bins of 1 mm and of 4 um");
  const std::vector<Hypothesis> objects{{random_map(251, 241, 0.02, 12.0, 457), 1.0},
                                        {random_map(31, 27, 0.5, 6.0, 843), 1.0}};
  const Recording recording = random_recording(4, 36, 458);
  HistogramOptions options = small_options();
  for (const Axis& axis : {Axis{-5.0, 5.0, 6}, Axis{0.0, 0.04, 10}}) {
    options.lattice.x_mm = options.lattice.y_mm = axis;
    hard.expect_posterior(objects, options, all_touches(recording));
    // 1e-14 mm of a place are 5e-13 cells of 24 nats.
    bounds.expect_laws(objects, options, recording, 1e-8);
  }
}

TEST(Size, CellsOfAHundredMillimetres) {
  HardCase hard("map cells of 100 mm");
  HardCase bounds("bounds: map cells of 100 mm");
  const std::vector<Hypothesis> objects{{random_map(5, 4, 100.0, 12.0, 459), 1.0},
                                        {random_map(7, 6, 80.0, 6.0, 846), 1.0}};
  const Recording recording = random_recording(4, 36, 460);
  HistogramOptions options = small_options();
  for (const auto& [x_mm, y_mm] : {std::pair(options.lattice.x_mm, options.lattice.y_mm),
                                   {Axis{-0.3, 0.3, 6}, Axis{-200.0, 300.0, 5}}}) {
    options.lattice.x_mm = x_mm;
    options.lattice.y_mm = y_mm;
    hard.expect_posterior(objects, options, all_touches(recording));
    bounds.expect_laws(objects, options, recording);
  }
}

TEST(Size, FourThousandElements) {
  HardCase hard("an array of 4,096 elements");
  HardCase bounds("bounds: an array of 4,096 elements");
  const std::vector<Hypothesis> objects{{random_map(61, 61, 0.5, 6.0, 461), 1.0},
                                        {random_map(31, 31, 1.0, 6.0, 462), 1.0}};
  // 1,024 logarithms per bin with errors of some 1e-7 nats each: 4.7e-4 and 3.5e-5 nats are seen.
  constexpr Allowed per_36{.nats = 4e-3, .near_top_nats = 3e-4};
  const Recording recording = random_recording(2, 4096, 463);
  hard.expect_posterior(objects, small_options(), all_touches(recording), per_36);
  hard.expect_map(recording.touches(0, 1), {.cell_mm = 1.0});
  BoundedOptions options{.lattice = small_options().lattice};
  for (const double gamma : {0.0, 0.1}) {
    options.contact.gamma = gamma;
    bounds.expect_laws(objects, options, recording, 1e-8);
    options.evidence_nats = 0.5;
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
    expect_named(input_error([&] { MapBuilder(shared_device(), options); }), {named});
  }
}

}  // namespace palpate::size_test
