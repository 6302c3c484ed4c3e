#include "recognition/reading_model.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "synthetic.hpp"

namespace palpate::smooth_occupancy_test {

TEST(SmoothOccupancy, BlursAnEdgeByTheSensorsSpread) {
  // Surely occupied where x < 0, empty elsewhere; the edge lies between two cells.
  OccupancyGrid map = random_map(80, 80, 0.25, 1.0, 861);
  map.spread_mm = 1.0;
  for (int j = 0; j < map.ny; ++j) {
    for (int i = 0; i < map.nx; ++i) {
      map.log_odds[static_cast<std::size_t>(j) * map.nx + i] = i < map.nx / 2 ? 60.0F : -60.0F;
    }
  }
  const double edge_mm = map.centre_mm(map.nx / 2, 0).x - 0.5 * map.cell_mm;
  const ContactModel contact{.prior = 0.2};
  const SmoothOccupancy smooth(map, contact);
  const Recording recording{
      .T_robot_sensor = {Pose{}}, .pressure = {10.0}, .elements_mm = {{0.0, 0.0}}};
  const LivingElements touch(recording.touch(0), contact);
  for (const double beyond_mm : {-2.8, -1.4, 0.0, 1.4, 2.8}) {
    const double y_mm = map.centre_mm(0, map.ny / 2).y;
    double occupancy = -1.0;
    smooth.sample(touch, {{edge_mm + beyond_mm, y_mm}, 0.3},
                  [&](const LivingElements::Element&, double value) { occupancy = value; });
    // A Gaussian of 1.4 times the spread, cut at three deviations, on cells of 0.25 mm.
    EXPECT_NEAR(occupancy, 0.5 * std::erfc(beyond_mm / 1.4 / std::sqrt(2.0)), 0.005) << beyond_mm;
  }
}

}  // namespace palpate::smooth_occupancy_test
