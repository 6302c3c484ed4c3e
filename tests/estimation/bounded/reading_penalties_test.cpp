#include "estimation/bounded/tables/window_table.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "bound_cases.hpp"
#include "model/map_likelihood.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"

namespace palpate::reading_penalties_test {

/// A square of a map: a rectangle.
struct Square {
  glm::dvec2 lower_mm;
  glm::dvec2 side_mm;

  double log_odds(const InterpolatedMap& map, double fx, double fy) const {
    return map.log_odds(lower_mm + side_mm * glm::dvec2(fx, fy));
  }
};

/// The places of a square, from 0 to 1 along an axis, at its ends and at the map's nodes.
std::vector<double> places_along(double lower_mm, double side_mm, double node_mm, double cell_mm) {
  std::vector<double> places{0.0, 1.0};
  const double first = std::ceil((lower_mm - node_mm) / cell_mm);
  for (double at = node_mm + first * cell_mm; at < lower_mm + side_mm; at += cell_mm) {
    places.push_back((at - lower_mm) / side_mm);
  }
  return places;
}

/// A map, a model and the reading that they are asked about.
struct ReadingCase {
  OccupancyGrid map;
  ContactModel contact;
  Reading reading = Reading::in_contact;
  std::size_t object = 0;

  double nats(double log_odds) const { return contact.log_likelihood(reading, {log_odds}, object); }
};

/// The largest log-likelihood in a square: bilinear log odds take all values between the least and
/// the largest of the corners' of its parts, and a table is largest at an end of this range or at a
/// node.
double largest_in(const ReadingCase& of, const InterpolatedMap& map, const Square& square) {
  double low = infinity;
  double high = -infinity;
  const auto& [lower_mm, side_mm] = square;
  const glm::dvec2& node_mm = of.map.origin_mm;
  for (const double fx : places_along(lower_mm.x, side_mm.x, node_mm.x, of.map.cell_mm)) {
    for (const double fy : places_along(lower_mm.y, side_mm.y, node_mm.y, of.map.cell_mm)) {
      const double l = square.log_odds(map, fx, fy);
      low = std::min(low, l);
      high = std::max(high, l);
    }
  }
  double largest = std::max(of.nats(low), of.nats(high));
  if (const auto& table = of.contact.table) {
    for (std::size_t node = 0; node < table->nodes; ++node) {
      const double l = std::lerp(table->first_log_odds, table->last_log_odds,
                                 static_cast<double>(node) / static_cast<double>(table->nodes - 1));
      largest = l >= low && l <= high ? std::max(largest, of.nats(l)) : largest;
    }
  }
  return largest;
}

class PartsOfCells : public testing::TestWithParam<glm::dvec2> {
 protected:
  /// Expects the penalties of all squares, each so many cells wide and high, to lie within a step
  /// below what their best place costs.
  static void expect_floors(const ReadingCase& of) {
    const InterpolatedMap map(of.map, *of.contact.prior);
    const double prior_log_odds = log_odds_from_probability(*of.contact.prior);
    const glm::dvec2 side_mm = of.map.cell_mm * GetParam();
    const MapSquares squares = map_squares(of.map, prior_log_odds, side_mm);
    const SquarePenalties penalties = square_penalties(squares, of.contact, of.reading, of.object);
    // No square lies beyond the map, and no part of the map beyond the squares.
    const glm::dvec2 map_mm = of.map.cell_mm * glm::dvec2(of.map.nx + 1, of.map.ny + 1);
    const glm::dvec2 reached = glm::dvec2(penalties.nx, penalties.ny) - map_mm / side_mm;
    ASSERT_TRUE(reached.x >= -1e-9 && reached.x < 1.0 && reached.y >= -1e-9 && reached.y < 1.0);
    ASSERT_EQ(penalties.least.size(), static_cast<std::size_t>(penalties.nx) * penalties.ny);
    // Rounding of places moves log odds of 1000 by 1e-9 nats at most, those of a table's steepest
    // level by as little: far below the hundredth of a penalty that rounding may take.
    constexpr double rounding = 0.02;
    const auto exact = [&](double nats) {
      return std::min((penalties.best - nats) * penalties_per_nat,
                      static_cast<double>(largest_penalty));
    };
    double best = of.nats(prior_log_odds);
    EXPECT_LE(penalties.beyond, exact(best));
    EXPECT_GE(penalties.beyond, exact(best) - 1.0 - rounding);
    for (int j = 0; j < penalties.ny; ++j) {
      for (int i = 0; i < penalties.nx; ++i) {
        SCOPED_TRACE(fmt::format("square {}, {}", i, j));
        const Square square{of.map.origin_mm - of.map.cell_mm + side_mm * glm::dvec2(i, j),
                            side_mm};
        const double least = penalties.least[static_cast<std::size_t>(j) * penalties.nx + i];
        const double largest = largest_in(of, map, square);
        best = std::max(best, largest);
        ASSERT_LE(least, largest_penalty);
        ASSERT_GE(least, exact(largest) - 1.0 - rounding);
        for (int k = 0; k < 13 * 13; ++k) {
          const double nats = of.nats(square.log_odds(map, k % 13 / 12.0, k / 13 / 12.0));
          ASSERT_LE(least, exact(nats)) << "at " << k % 13 << "/12, " << k / 13 << "/12";
        }
      }
    }
    EXPECT_NEAR(penalties.best, best, 1e-9 * (1.0 + std::abs(best))) << "rounding of places";
  }
};

TEST_P(PartsOfCells, HaveTheirLeastPenaltyByEquationSeven) {
  for (const double gamma : {0.1, 0.0}) {
    for (const double prior : {0.2, 1e-6}) {
      for (const double steepness : {0.0, 1.0, 12.0, 1000.0}) {
        for (const Reading reading : {Reading::no_contact, Reading::in_contact}) {
          SCOPED_TRACE(fmt::format("gamma {}, prior {}, log odds +-{}, reading {}", gamma, prior,
                                   steepness, static_cast<int>(reading)));
          expect_floors(
              {random_map(5, 4, 0.5, steepness, 201), {.gamma = gamma, .prior = prior}, reading});
        }
      }
    }
  }
  for (const glm::ivec2 cells : {glm::ivec2(1, 1), {1, 9}, {3, 2}}) {
    for (const double cell_mm : {0.02, 0.37, 100.0}) {
      SCOPED_TRACE(fmt::format("{} x {} cells of {} mm", cells.x, cells.y, cell_mm));
      expect_floors({random_map(cells.x, cells.y, cell_mm, 6.0, 203), {.prior = 0.2}});
    }
  }
}

TEST_P(PartsOfCells, HaveTheirLeastPenaltyByATable) {
  const LikelihoodTable table = crooked_table_of_two();
  for (const double steepness : {0.3, 4.0, 12.0, 1000.0}) {
    for (std::size_t object = 0; object < 2; ++object) {
      for (std::size_t level = 0; level < table.levels(); ++level) {
        SCOPED_TRACE(fmt::format("log odds +-{}, object {}, level {}", steepness, object, level));
        expect_floors({random_map(5, 4, 0.5, steepness, 202),
                       {.prior = 0.2, .table = table},
                       static_cast<Reading>(level),
                       object});
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Parts, PartsOfCells,
                         testing::Values(glm::dvec2(1.0), glm::dvec2(0.5), glm::dvec2(0.25),
                                         glm::dvec2(8.0), glm::dvec2(0.83, 0.86),
                                         glm::dvec2(1.0, 2.5), glm::dvec2(0.31, 40.0)));

}  // namespace palpate::reading_penalties_test
