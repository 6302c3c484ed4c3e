#include "reading_penalties.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "bins_by_definition.hpp"
#include "interpolated_map.hpp"
#include "synthetic.hpp"

namespace palpate {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// A square of a map's divided cells.
struct Square {
  glm::dvec2 lower_mm;
  double side_mm = 0.0;
};

Square square_at(const OccupancyGrid& map, int parts, int i, int j) {
  const double side_mm = map.cell_mm / parts;
  return {map.origin_mm - map.cell_mm + side_mm * glm::dvec2(i, j), side_mm};
}

double log_odds_in(const InterpolatedMap& map, const Square& square, double fx, double fy) {
  return map.log_odds(square.lower_mm + square.side_mm * glm::dvec2(fx, fy));
}

/// The largest log-likelihood in a square: bilinear log odds take all values between the least and
/// the largest of the corners', and a table is largest at an end of this range or at a node.
double largest_in(const InterpolatedMap& map, const ContactModel& contact, Reading reading,
                  std::size_t object, const Square& square) {
  double low = infinity;
  double high = -infinity;
  for (const double fx : {0.0, 1.0}) {
    for (const double fy : {0.0, 1.0}) {
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

void expect_floors(const OccupancyGrid& grid, const ContactModel& contact, Reading reading,
                   std::size_t object, int parts) {
  const InterpolatedMap map(grid, *contact.prior);
  const SquarePenalties penalties = square_penalties(grid, contact, reading, object, parts);
  ASSERT_EQ(penalties.parts, parts);
  ASSERT_EQ(penalties.nx, (grid.nx + 1) * parts);
  ASSERT_EQ(penalties.ny, (grid.ny + 1) * parts);
  ASSERT_EQ(penalties.least.size(), static_cast<std::size_t>(penalties.nx) * penalties.ny);
  // Rounding of places moves log odds of 1000 by 1e-9 nats at most, those of a table's steepest
  // level by as little: far below the hundredth of a penalty that rounding may take.
  constexpr double rounding = 0.02;
  const auto exact = [&](double nats) {
    return std::min((penalties.best - nats) * penalties_per_nat,
                    static_cast<double>(largest_penalty));
  };
  const double prior =
      contact.log_likelihood(reading, {log_odds_from_probability(*contact.prior)}, object);
  EXPECT_LE(penalties.beyond, exact(prior));
  EXPECT_GE(penalties.beyond, exact(prior) - 1.0 - rounding);
  double best = prior;
  for (int j = 0; j < penalties.ny; ++j) {
    for (int i = 0; i < penalties.nx; ++i) {
      const Square square = square_at(grid, parts, i, j);
      const double least = penalties.least[static_cast<std::size_t>(j) * penalties.nx + i];
      const double largest = largest_in(map, contact, reading, object, square);
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

class PartsOfCells : public testing::TestWithParam<int> {};

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

INSTANTIATE_TEST_SUITE_P(Parts, PartsOfCells, testing::Values(1, 2, 4));

TEST(ReadingPenalties, StopAtTheLargestPenalty) {
  ContactModel contact;
  contact.prior = 0.2;
  contact.gamma = 0.0;
  OccupancyGrid map = random_map(6, 6, 0.5, 1.0, 204);
  std::fill(map.log_odds.begin(), map.log_odds.begin() + 18, 40.0F);
  std::fill(map.log_odds.begin() + 18, map.log_odds.end(), -1000.0F);
  const SquarePenalties penalties = square_penalties(map, contact, Reading::in_contact, 0, 1);
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
  const SquarePenalties penalties = square_penalties(map, contact, Reading::no_contact, 0, 2);
  EXPECT_EQ(penalties.beyond, 0);
  EXPECT_EQ(std::count(penalties.least.begin(), penalties.least.end(), 0), 14 * 14);
}

}  // namespace
}  // namespace palpate
