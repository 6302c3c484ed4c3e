#include "palpate/reading_layer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "palpate/error.hpp"

namespace palpate::reading_layer_test {

/// A map in which a share of the cells was sensed.
OccupancyGrid sparse_map(int nx, int ny, double share, unsigned seed) {
  OccupancyGrid map;
  map.label = "A";
  map.cell_mm = 0.75;
  map.origin_mm = {-3.0, 4.5};
  map.nx = nx;
  map.ny = ny;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int k = 0; k < nx * ny; ++k) {
    const bool sensed = uniform(random) < share;
    map.observations.push_back(sensed ? 1.0F : 0.0F);
    map.log_odds.push_back(sensed ? static_cast<float>(30.0 * uniform(random) - 15.0)
                                  : static_cast<float>(map.prior_log_odds()));
    map.mean_level.push_back(sensed ? static_cast<float>(300.0 * uniform(random)) : 0.0F);
  }
  return map;
}

TEST(ReadingLayer, HoldsTheDefinitionInEveryCell) {
  const ReadingLayer how{.near_mm = 1.6, .far_mm = 4.1};
  for (unsigned seed = 0; seed < 20; ++seed) {
    const OccupancyGrid map =
        sparse_map(3 + static_cast<int>(seed), 11, seed % 2 == 0 ? 0.05 : 0.4, seed);
    const OccupancyGrid layer = reading_layer(map, how);
    EXPECT_EQ(layer.cell_mm, map.cell_mm);
    EXPECT_NEAR(layer.prior_log_odds(), ReadingLayer::beyond, 1e-9);
    const int border = (layer.nx - map.nx) / 2;
    EXPECT_EQ(layer.ny, map.ny + 2 * border);
    EXPECT_GE(border * map.cell_mm, how.far_mm);
    EXPECT_EQ(layer.centre_mm(border, border), map.centre_mm(0, 0));
    for (int j = 0; j < layer.ny; ++j) {
      for (int i = 0; i < layer.nx; ++i) {
        double nearest = INFINITY;
        double value = ReadingLayer::beyond;
        bool tie = false;  // of a free and an occupied cell: either may count
        bool occupied = false;
        for (int l = 0; l < map.ny; ++l) {
          for (int k = 0; k < map.nx; ++k) {
            const auto at = static_cast<std::size_t>(l) * map.nx + k;
            if (map.observations[at] > 0.0F) {
              const double mm = std::hypot(i - border - k, j - border - l) * map.cell_mm;
              const bool here = map.log_odds[at] > 0.0F;
              tie = mm < nearest ? false : tie || (mm == nearest && here != occupied);
              occupied = mm < nearest ? here : occupied;
              value = mm == 0.0 ? std::clamp(double{map.log_odds[at]}, -8.0, 8.0) : value;
              nearest = std::min(nearest, mm);
            }
          }
        }
        if (nearest > 0.0 && nearest <= how.far_mm) {
          value = nearest <= how.near_mm ? (occupied ? -15.0 : -10.0) : (occupied ? -14.0 : -11.0);
        }
        if (!tie) {
          ASSERT_NEAR(layer.at(i, j), value, 1e-6) << seed << ": " << i << ", " << j;
        }
      }
    }
  }
}

TEST(ReadingLayer, ScalesMeanLevelsByTheirLogarithm) {
  OccupancyGrid map = sparse_map(4, 1, 1.0, 1);
  map.mean_level = {0.0F, 1.0F, 255.0F, 1000.0F};
  const OccupancyGrid layer =
      reading_layer(map, {.of = MapLayer::mean_level, .near_mm = 0.0, .far_mm = 0.0});
  ASSERT_EQ(layer.nx, 6);
  EXPECT_NEAR(layer.at(1, 1), -8.0, 1e-6);
  EXPECT_NEAR(layer.at(2, 1), 16.0 * std::log(2.0) / std::log(256.0) - 8.0, 1e-6);
  EXPECT_NEAR(layer.at(3, 1), 8.0, 1e-6);
  EXPECT_NEAR(layer.at(4, 1), 8.0, 1e-6) << "clamped";
}

TEST(ReadingLayer, TakesThePriorForUnseenWhereNothingWasCounted) {
  OccupancyGrid map = sparse_map(5, 1, 1.0, 2);
  map.observations.clear();
  map.log_odds = {1.0F, static_cast<float>(map.prior_log_odds()), -2.0F, -3.0F, 4.0F};
  const OccupancyGrid layer = reading_layer(map, {.near_mm = 1.0, .far_mm = 1.0});
  const int border = (layer.nx - map.nx) / 2;
  EXPECT_EQ(layer.at(border, border), 1.0F);
  EXPECT_LT(layer.at(border + 1, border), -8.0F);
  EXPECT_EQ(layer.at(border + 2, border), -2.0F);
}

TEST(ReadingLayer, RefusesWhatCannotBe) {
  OccupancyGrid map = sparse_map(5, 5, 0.5, 3);
  EXPECT_THROW(reading_layer(map, {.near_mm = 5.0, .far_mm = 4.0}), Error);
  EXPECT_THROW(reading_layer(map, {.unit_level = 0.0}), Error);
  EXPECT_THROW(reading_layer(map, {.far_mm = 1e6}), Error);
  map.mean_level.clear();
  try {
    reading_layer(map, {.of = MapLayer::mean_level});
    FAIL() << "a map without mean levels was taken";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("palpate map `sensor-model`"), std::string::npos);
  }
}

}  // namespace palpate::reading_layer_test
