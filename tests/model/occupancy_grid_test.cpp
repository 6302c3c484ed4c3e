#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "palpate/learned_sensor.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/pose_error.hpp"
#include "reference/reference.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"

namespace palpate::occupancy_grid_test {

/// What is said of a sound map, 1.5 mm wide, after the change.
std::string fault_after(const std::function<void(OccupancyGrid&)>& change) {
  OccupancyGrid map{
      .label = "A", .origin_mm = {1.0, 2.0}, .nx = 3, .ny = 2, .log_odds = {1, 2, 3, 4, 5, 6}};
  change(map);
  return fault_of(map).value_or("");
}

void expect_fault(const std::function<void(OccupancyGrid&)>& change, const char* says) {
  expect_named(fault_after(change), {says});
}

TEST(FaultOfAMap, IsNoneWithinTheBounds) {
  const auto expect_none = [](const std::function<void(OccupancyGrid&)>& change) {
    EXPECT_EQ(fault_after(change), "");
  };
  expect_none([](OccupancyGrid&) {});
  for (const double cell_mm : {least_length_mm, most_length_mm}) {
    expect_none([&](OccupancyGrid& m) { m.cell_mm = cell_mm; });
  }
  for (const double spread_mm : {least_length_mm, 0.7, 1.5}) {
    expect_none([&](OccupancyGrid& m) { m.spread_mm = spread_mm; });
  }
  expect_none([](OccupancyGrid& m) { m.origin_mm = {-farthest_mm, farthest_mm - 0.5}; });
  expect_none([](OccupancyGrid& m) { m.log_odds[3] = -1e30F; });
  expect_none([](OccupancyGrid& m) { m.symmetry = 0; });
  expect_none([](OccupancyGrid& m) { m.label = ""; });
}

TEST(FaultOfAMap, NamesTheFieldAndItsValue) {
  for (const double cell_mm : {0.0, -0.5, nan, infinity, 1e-7, 1.1e6, 1e154, 1e200}) {
    expect_fault([&](OccupancyGrid& m) { m.cell_mm = cell_mm; }, "'cell_mm' = ");
  }
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

TEST(FaultOfAMap, IsSaidByWhateverReadsItsCells) {
  OccupancyGrid map{.label = "A\nB", .nx = 400, .ny = 2, .log_odds = {1, 2, 3}};
  for (const std::function<void()>& use : std::initializer_list<std::function<void()>>{
           [&] { mirror_image(map); }, [&] { centre_frame(map); }, [&] { measure_symmetry(map); },
           [&] { reading_layer(map, {}); }, [&] { fit_of({}, {}, map, {}); }}) {
    EXPECT_EQ(input_error(use), "map 'A B': 400 x 2 cells but 3 log odds; make them agree");
  }
}

constexpr Reading in = Reading::in_contact;
constexpr Reading no = Reading::no_contact;

TEST(LogOdds, AndProbabilityAreInverse) {
  EXPECT_EQ(log_odds_from_probability(0.5), 0.0);
  EXPECT_DOUBLE_EQ(log_odds_from_probability(0.2), -std::log(4.0));
  EXPECT_EQ(probability_from_log_odds(1000.0), 1.0);
  EXPECT_EQ(probability_from_log_odds(-1000.0), 0.0);
  for (double p = 0.001; p < 1.0; p += 0.037) {
    EXPECT_NEAR(probability_from_log_odds(log_odds_from_probability(p)), p, 1e-15) << "rounding";
  }
}

TEST(InverseSensorModel, IsEquations4To6) {
  for (const double prior : {0.05, 0.2, 0.5, 0.8}) {
    for (const double peak : {0.1, 0.9, 0.999}) {
      for (const double spread_mm : {0.25, 0.5, 2.0}) {
        const InverseSensorModel model{.spread_mm = spread_mm, .peak = peak, .prior = prior};
        // Beyond 4 spreads the reference itself loses digits of log(p / (1 - p)).
        for (double d = 0.0; d < 4.0 * spread_mm; d += 0.1 * spread_mm) {
          for (const Reading reading : {in, no, Reading::unknown}) {
            EXPECT_NEAR(model.increment(reading, d), reference::increment(reading, d, model), 1e-12)
                << "float64 rounding of logs near 10";
          }
        }
      }
    }
  }
}

TEST(InverseSensorModel, SupportRadiusKeepsTheCutSumBelowTheTolerance) {
  for (const double prior : {0.02, 0.2, 0.5, 0.98}) {
    for (const double peak : {1e-9, 0.3, 0.9, 0.9999}) {
      for (const std::size_t readings : {1U, 36U, 7000U, 1000000U}) {
        const InverseSensorModel model{.spread_mm = 0.7, .peak = peak, .prior = prior};
        const double radius = model.support_radius_mm(readings, 5e-4);
        const auto all = static_cast<double>(readings);
        EXPECT_LE(all * std::abs(model.increment(in, radius)), 5e-4 * (1.0 + 1e-9));
        EXPECT_LE(all * std::abs(model.increment(no, radius)), 5e-4 * (1.0 + 1e-9));
        EXPECT_LE(radius, 10.0 * model.spread_mm) << "cuts off nothing worth the time";
      }
    }
  }
}

TEST(InverseSensorModel, RefusesWhatIsOutOfRange) {
  const auto expect_refused = [](const InverseSensorModel& model, const std::string& field) {
    const std::string said = input_error([&] { model.validate(); });
    EXPECT_TRUE(said.starts_with(field)) << said;
  };
  for (const double spread : {0.0, -1.0, nan, infinity}) {
    expect_refused({.spread_mm = spread}, "spread");
  }
  for (const double p : {0.0, 1.0, -0.1, 1.5, nan}) {
    expect_refused({.peak = p}, "peak");
    expect_refused({.prior = p}, "prior");
  }
}

}  // namespace palpate::occupancy_grid_test
