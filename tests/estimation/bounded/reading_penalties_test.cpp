#include "estimation/bounded/tables/window_table.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "bins_by_definition.hpp"
#include "model/interpolated_map.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"

namespace palpate::reading_penalties_test {

/// A square of a map: a rectangle.
struct Square {
  glm::dvec2 lower_mm;
  glm::dvec2 side_mm;
};

Square square_at(const OccupancyGrid& map, const glm::dvec2& side_mm, int i, int j) {
  return {map.origin_mm - map.cell_mm + side_mm * glm::dvec2(i, j), side_mm};
}

double log_odds_in(const InterpolatedMap& map, const Square& square, double fx, double fy) {
  return map.log_odds(square.lower_mm + square.side_mm * glm::dvec2(fx, fy));
}

/// The places of a square, from 0 to 1 along an axis, at its ends and at the map's nodes.
std::vector<double> places_along(double lower_mm, double side_mm, double node_mm, double cell_mm) {
  std::vector<double> places{0.0, 1.0};
  const double first = std::ceil((lower_mm - node_mm) / cell_mm);
  for (double at = node_mm + first * cell_mm; at < lower_mm + side_mm; at += cell_mm) {
    places.push_back((at - lower_mm) / side_mm);
  }
  return places;
}

/// The largest log-likelihood in a square: bilinear log odds take all values between the least and
/// the largest of the corners' of its parts, and a table is largest at an end of this range or at a
/// node.
double largest_in(const OccupancyGrid& grid, const InterpolatedMap& map,
                  const ContactModel& contact, Reading reading, std::size_t object,
                  const Square& square) {
  double low = infinity;
  double high = -infinity;
  const glm::dvec2& node_mm = grid.origin_mm;
  for (const double fx :
       places_along(square.lower_mm.x, square.side_mm.x, node_mm.x, grid.cell_mm)) {
    for (const double fy :
         places_along(square.lower_mm.y, square.side_mm.y, node_mm.y, grid.cell_mm)) {
      const double l = log_odds_in(map, square, fx, fy);
      low = std::min(low, l);
      high = std::max(high, l);
    }
  }
  double largest = std::max(contact.log_likelihood(reading, {low}, object),
                            contact.log_likelihood(reading, {high}, object));
  if (contact.table) {
    const LikelihoodTable& table = *contact.table;
    for (std::size_t node = 0; node < table.nodes; ++node) {
      const double l = std::lerp(table.first_log_odds, table.last_log_odds,
                                 static_cast<double>(node) / static_cast<double>(table.nodes - 1));
      if (l >= low && l <= high) {
        largest = std::max(largest, contact.log_likelihood(reading, {l}, object));
      }
    }
  }
  return largest;
}

/// @param cells of a square along each axis
void expect_floors(const OccupancyGrid& grid, const ContactModel& contact, Reading reading,
                   std::size_t object, const glm::dvec2& cells) {
  const InterpolatedMap map(grid, *contact.prior);
  const double prior_log_odds = log_odds_from_probability(*contact.prior);
  const glm::dvec2 side_mm = grid.cell_mm * cells;
  const MapSquares squares = map_squares(grid, prior_log_odds, side_mm);
  const SquarePenalties penalties = square_penalties(squares, contact, reading, object);
  // No square lies beyond the map, and no part of the map beyond the squares.
  const glm::dvec2 map_mm = grid.cell_mm * glm::dvec2(grid.nx + 1, grid.ny + 1);
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
  const double prior = contact.log_likelihood(reading, {prior_log_odds}, object);
  EXPECT_LE(penalties.beyond, exact(prior));
  EXPECT_GE(penalties.beyond, exact(prior) - 1.0 - rounding);
  double best = prior;
  for (int j = 0; j < penalties.ny; ++j) {
    for (int i = 0; i < penalties.nx; ++i) {
      const Square square = square_at(grid, side_mm, i, j);
      const double least = penalties.least[static_cast<std::size_t>(j) * penalties.nx + i];
      const double largest = largest_in(grid, map, contact, reading, object, square);
      best = std::max(best, largest);
      ASSERT_LE(least, largest_penalty);
      ASSERT_GE(least, exact(largest) - 1.0 - rounding) << "square " << i << ", " << j;
      for (int k = 0; k <= 12; ++k) {
        for (int l = 0; l <= 12; ++l) {
          const double nats = contact.log_likelihood(
              reading, {log_odds_in(map, square, k / 12.0, l / 12.0)}, object);
          ASSERT_LE(least, exact(nats))
              << "square " << i << ", " << j << " at " << k << "/12, " << l << "/12";
        }
      }
    }
  }
  EXPECT_NEAR(penalties.best, best, 1e-9 * (1.0 + std::abs(best))) << "rounding of places";
}

class PartsOfCells : public testing::TestWithParam<glm::dvec2> {};

TEST_P(PartsOfCells, HaveTheirLeastPenaltyByEquationSeven) {
  for (const double gamma : {0.1, 0.0}) {
    for (const double prior : {0.2, 1e-6}) {
      for (const double steepness : {1.0, 12.0, 1000.0}) {
        for (const Reading reading : {Reading::no_contact, Reading::in_contact}) {
          SCOPED_TRACE(fmt::format("gamma {}, prior {}, log odds +-{}, reading {}", gamma, prior,
                                   steepness, static_cast<int>(reading)));
          ContactModel contact;
          contact.gamma = gamma;
          contact.prior = prior;
          expect_floors(random_map(5, 4, 0.5, steepness, 201), contact, reading, 0, GetParam());
        }
      }
    }
  }
}

TEST_P(PartsOfCells, HaveTheirLeastPenaltyByATable) {
  ContactModel contact;
  contact.prior = 0.2;
  contact.table = crooked_table();
  const std::vector<double> first = contact.table->log_likelihood;
  contact.table->log_likelihood.insert(contact.table->log_likelihood.end(), first.rbegin(),
                                       first.rend());
  for (const double steepness : {0.3, 4.0, 12.0, 1000.0}) {
    for (std::size_t object = 0; object < 2; ++object) {
      for (std::size_t level = 0; level < contact.table->levels(); ++level) {
        SCOPED_TRACE(fmt::format("log odds +-{}, object {}, level {}", steepness, object, level));
        expect_floors(random_map(5, 4, 0.5, steepness, 202), contact, static_cast<Reading>(level),
                      object, GetParam());
      }
    }
  }
}

TEST_P(PartsOfCells, OfMapsOfAnyShapeAndCellHaveTheirLeastPenalty) {
  ContactModel contact;
  contact.prior = 0.2;
  for (const glm::ivec2 cells : {glm::ivec2(1, 1), {1, 9}, {3, 2}}) {
    for (const double cell_mm : {0.02, 0.37, 100.0}) {
      expect_floors(random_map(cells.x, cells.y, cell_mm, 6.0, 203), contact, Reading::in_contact,
                    0, GetParam());
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Parts, PartsOfCells,
                         testing::Values(glm::dvec2(1.0), glm::dvec2(0.5), glm::dvec2(0.25),
                                         glm::dvec2(8.0), glm::dvec2(0.83, 0.86),
                                         glm::dvec2(1.0, 2.5), glm::dvec2(0.31, 40.0)));

TEST(ReadingPenalties, StopAtTheLargestPenalty) {
  ContactModel contact;
  contact.prior = 0.2;
  contact.gamma = 0.0;
  OccupancyGrid map = random_map(6, 6, 0.5, 1.0, 204);
  std::fill(map.log_odds.begin(), map.log_odds.begin() + 18, 40.0F);
  std::fill(map.log_odds.begin() + 18, map.log_odds.end(), -1000.0F);
  const SquarePenalties penalties =
      square_penalties(map_squares(map, log_odds_from_probability(0.2), glm::dvec2(0.5)), contact,
                       Reading::in_contact, 0);
  // The rows between the last two nodes cost some 1000 nats, the first ones nothing.
  EXPECT_EQ(penalties.least[5 * penalties.nx + 3], largest_penalty);
  EXPECT_EQ(penalties.least[2 * penalties.nx + 3], 0);
}

TEST(ReadingPenalties, OfAMapOfThePriorAreNone) {
  ContactModel contact;
  contact.prior = 0.2;
  OccupancyGrid map = random_map(6, 6, 0.5, 1.0, 205);
  std::fill(map.log_odds.begin(), map.log_odds.end(),
            static_cast<float>(log_odds_from_probability(0.2)));
  const SquarePenalties penalties =
      square_penalties(map_squares(map, log_odds_from_probability(0.2), glm::dvec2(0.25)), contact,
                       Reading::no_contact, 0);
  EXPECT_EQ(penalties.beyond, 0);
  EXPECT_EQ(std::count(penalties.least.begin(), penalties.least.end(), 0), 14 * 14);
}

}  // namespace palpate::reading_penalties_test
