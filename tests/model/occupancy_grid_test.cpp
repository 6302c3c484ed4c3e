#include "palpate/occupancy_grid.hpp"

#include <functional>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "palpate/pose.hpp"
#include "support/limits.hpp"

namespace palpate::occupancy_grid_test {

OccupancyGrid sound_map() {
  return {.label = "A", .origin_mm = {1.0, 2.0}, .nx = 3, .ny = 2, .log_odds = {1, 2, 3, 4, 5, 6}};
}

std::string fault_after(const std::function<void(OccupancyGrid&)>& change) {
  OccupancyGrid map = sound_map();
  change(map);
  return fault_of(map).value_or("");
}

void expect_fault(const std::function<void(OccupancyGrid&)>& change, const std::string& says) {
  const std::string fault = fault_after(change);
  EXPECT_NE(fault.find(says), std::string::npos) << "'" << fault << "' does not say " << says;
}

TEST(FaultOfAMap, IsNoneWithinTheBounds) {
  EXPECT_EQ(fault_of(sound_map()), std::nullopt);
  for (const double cell_mm : {least_length_mm, most_length_mm}) {
    EXPECT_EQ(fault_after([&](OccupancyGrid& m) { m.cell_mm = cell_mm; }), "");
  }
  for (const double spread_mm : {least_length_mm, 0.7, 1.5}) {
    EXPECT_EQ(fault_after([&](OccupancyGrid& m) { m.spread_mm = spread_mm; }), "");
  }
  EXPECT_EQ(fault_after([](OccupancyGrid& m) {
              m.origin_mm = {-farthest_mm, farthest_mm - 0.5};
            }),
            "");
  EXPECT_EQ(fault_after([](OccupancyGrid& m) { m.log_odds[3] = -1e30F; }), "");
  EXPECT_EQ(fault_after([](OccupancyGrid& m) { m.symmetry = 0; }), "");
  EXPECT_EQ(fault_after([](OccupancyGrid& m) { m.label = ""; }), "");
}

TEST(FaultOfAMap, NamesTheFieldAndItsValue) {
  for (const double cell_mm : {0.0, -0.5, nan, infinity, 1e-7, 1.1e6, 1e154, 1e200}) {
    expect_fault([&](OccupancyGrid& m) { m.cell_mm = cell_mm; }, "'cell_mm' = ");
  }
  // The grid is 1.5 mm wide.
  for (const double spread_mm : {0.0, -0.5, nan, infinity, 1e-7, 1.6, 500.0}) {
    expect_fault([&](OccupancyGrid& m) { m.spread_mm = spread_mm; }, "'spread_mm' = ");
  }
  for (const double x_mm : {nan, infinity, 1.1e9, -1e300, 1e9 - 0.4}) {
    expect_fault([&](OccupancyGrid& m) { m.origin_mm.x = x_mm; }, "'origin_mm' = ");
    expect_fault([&](OccupancyGrid& m) { m.origin_mm.y = x_mm + 0.5; }, "'origin_mm' = ");
  }
  for (const double prior : {0.0, 1.0, -0.1, nan}) {
    expect_fault([&](OccupancyGrid& m) { m.prior = prior; }, "'prior' = ");
  }
  expect_fault([](OccupancyGrid& m) { m.symmetry = -1; }, "'symmetry' = -1");
  expect_fault([](OccupancyGrid& m) { m.suggested_symmetry = -1; }, "'suggested_symmetry' = -1");
  expect_fault([](OccupancyGrid& m) { m.label = "(none)"; }, "'label' = '(none)'");
  for (const double l : {nan, infinity, -infinity, 1.1e30, -2e30}) {
    expect_fault([&](OccupancyGrid& m) { m.log_odds[5] = static_cast<float>(l); },
                 "'log_odds'[1, 2] = ");
  }
}

TEST(FaultOfAMap, NamesCellsThatDoNotAgreeOrAreTooMany) {
  expect_fault([](OccupancyGrid& m) { m.nx = 4; }, "4 x 2 cells but 6 log odds");
  expect_fault([](OccupancyGrid& m) { m.ny = 0; }, "3 x 0 cells");
  expect_fault([](OccupancyGrid& m) { m.nx = m.ny = -1; }, "-1 x -1 cells");
  expect_fault([](OccupancyGrid& m) { m.log_odds.clear(); }, "but 0 log odds");
  expect_fault([](OccupancyGrid& m) { m.nx = m.ny = std::numeric_limits<int>::max(); },
               "at most 1073741824");
}

}  // namespace palpate::occupancy_grid_test
