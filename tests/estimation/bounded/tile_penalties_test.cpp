// Tables of the least penalties of windows, and the penalties of tiles, which they sum.

#include "estimation/bounded/tables/window_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include <gtest/gtest.h>

#include "bound_cases.hpp"
#include "support/every_set_of_instructions.hpp"
#include "support/synthetic.hpp"

namespace palpate::tile_penalties_test {

/// Penalties of independent squares, from 0 to `largest`; the largest occurs, also beyond.
SquarePenalties random_penalties(int nx, int ny, std::uint16_t largest, std::uint64_t seed) {
  Uniform random(seed);
  SquarePenalties penalties{.best = -0.3, .nx = nx, .ny = ny, .least = {}, .beyond = largest};
  for (int i = 0; i < nx * ny; ++i) {
    penalties.least.push_back(static_cast<std::uint16_t>(random(0.0, largest + 1.0)));
  }
  penalties.least.back() = largest;
  return penalties;
}

/// The least penalty within so many squares along each axis from square (x, y) on, by definition.
std::uint16_t least_penalty(const SquarePenalties& penalties, int window, int x, int y) {
  std::uint16_t least = std::numeric_limits<std::uint16_t>::max();
  for (int j = y; j < y + window; ++j) {
    for (int i = x; i < x + window; ++i) {
      const bool inside = i >= 0 && j >= 0 && i < penalties.nx && j < penalties.ny;
      least =
          std::min(least, inside ? penalties.least[static_cast<std::size_t>(j) * penalties.nx + i]
                                 : penalties.beyond);
    }
  }
  return least;
}

/// Calls visit(x, y, row, column, entry) with the square at which each entry's window begins.
template <typename Visit>
void for_entries(const WindowTable& table, const Visit& visit) {
  const int side = 1 << table.side_log2;
  auto entry = table.entries.begin();
  for (int phase_y = 0; phase_y < side; ++phase_y) {
    for (int phase_x = 0; phase_x < side; ++phase_x) {
      for (int row = 0; row < table.rows; ++row) {
        for (int column = 0; column < table.columns; ++column) {
          for (int j = 0; j < batch_side; ++j, ++entry) {
            visit((column - WindowTable::margin) * side + phase_x,
                  (row + j - WindowTable::margin) * side + phase_y, row, column, *entry);
          }
        }
      }
    }
  }
}

TEST(WindowTable, HoldsTheLeastPenaltyOfEveryWindow) {
  for (const glm::ivec2 squares : {glm::ivec2(2, 2), {7, 5}, {16, 9}, {33, 1}}) {
    for (const auto& [side, window] :
         {std::pair(1, 2), {2, 3}, {4, 5}, {8, 9}, {1, 1}, {2, 1}, {8, 1}}) {
      SCOPED_TRACE(testing::Message() << squares.x << " x " << squares.y << ", side " << side
                                      << ", window " << window);
      const SquarePenalties penalties = random_penalties(squares.x, squares.y, 8192, 91);
      const WindowTable table = window_table(penalties, side, window);
      ASSERT_EQ(1 << table.side_log2, side);
      ASSERT_EQ(table.best, penalties.best);
      ASSERT_EQ(table.beyond, penalties.beyond);
      ASSERT_EQ(table.entries.size(),
                static_cast<std::size_t>(side) * side * table.rows * table.columns * batch_side);
      std::uint16_t largest = 0;
      for_entries(table, [&](int x, int y, int, int, std::uint16_t entry) {
        ASSERT_EQ(entry, least_penalty(penalties, window, x, y)) << "square " << x << ", " << y;
        largest = std::max(largest, entry);
      });
      EXPECT_EQ(table.largest, largest);
    }
  }
}

TEST(WindowTable, EndsInBatchesThatSeeOnlyThePrior) {
  // Farther batches take the entries of these.
  for (const int side : {1, 2, 8}) {
    SquarePenalties penalties = random_penalties(13, 11, 100, 92);
    penalties.beyond = 200;
    const WindowTable table = window_table(penalties, side, side + 1);
    for_entries(table, [&](int x, int y, int row, int column, std::uint16_t entry) {
      if (column < batch_side || column >= table.columns - batch_side || row < 1 ||
          row >= table.rows - batch_side) {
        ASSERT_EQ(entry, 200) << "side " << side << ", square " << x << ", " << y;
      }
    });
  }
}

/// Elements over squares of a table, the batch of tiles and the sums before them.
struct BatchCase {
  SquarePenalties penalties;
  int side = 1;
  int window = 2;  ///< squares that an element sees
  KnownElements elements;
  TilePlace place;
  int first_x = 0;
  int first_y = 0;
  std::uint32_t before = 0;
};

BatchCase random_batch(std::size_t elements, int side, std::uint16_t largest, std::uint64_t seed) {
  Uniform random(seed);
  const double theta = random(-4.0, 4.0);
  BatchCase of{.penalties = random_penalties(23, 17, largest, seed + 1),
               .side = side,
               .window = side + 1,
               .elements = random_elements(elements, 9.0, 1, seed + 2),
               .place = {.turn = {std::cos(theta), std::sin(theta)},
                         .corner_mm = {random(-8.0, 8.0), random(-8.0, 8.0)},
                         .square_mm = {0.37, 0.29}}};
  of.first_x = static_cast<int>(random(0.0, 48.0 / side));
  of.first_y = static_cast<int>(random(0.0, 48.0 / side));
  // Some are so far off that their squares have no number.
  for (std::size_t e = 0; e < elements; e += 11) {
    of.elements.from_pivot_mm[e] *= std::pow(10.0, random(0.0, 9.0));
  }
  return of;
}

/// Sums of the tiles' penalties by definition, [x, y].
std::vector<std::uint32_t> sums_by_definition(const BatchCase& of) {
  std::vector<std::uint64_t> sums(batch_tiles, of.before);
  const TilePlace& place = of.place;
  for (const glm::dvec2& p : of.elements.from_pivot_mm) {
    // Beyond 2^28 squares all is the prior; no batch here is as far.
    const auto square = [&](double mm, double square_mm) {
      return static_cast<int>(std::clamp(std::floor(mm / square_mm), -1e6, 1e6));
    };
    const int x =
        square(place.turn.x * p.x - place.turn.y * p.y + place.corner_mm.x, place.square_mm.x);
    const int y =
        square(place.turn.y * p.x + place.turn.x * p.y + place.corner_mm.y, place.square_mm.y);
    for (int i = 0; i < batch_side; ++i) {
      for (int j = 0; j < batch_side; ++j) {
        sums[batch_side * i + j] +=
            least_penalty(of.penalties, of.window, x + of.side * (of.first_x + i),
                          y + of.side * (of.first_y + j));
      }
    }
  }
  std::vector<std::uint32_t> capped;
  for (const std::uint64_t sum : sums) {
    capped.push_back(static_cast<std::uint32_t>(std::min<std::uint64_t>(sum, largest_sum)));
  }
  return capped;
}

/// @param split elements of the first of two runs
std::vector<std::uint32_t> summed(const BatchCase& of, const WindowTable& table,
                                  std::size_t split = 0) {
  WindowPlaces placed;
  place_windows(of.elements, of.place, table, placed);
  std::vector<std::uint32_t> sums(batch_tiles, of.before);
  const std::array<TableRun, 2> runs{
      {{&table, 0, split}, {&table, split, of.elements.from_pivot_mm.size()}}};
  add_penalties(placed, runs, of.first_x, of.first_y, sums.data());
  return sums;
}

void expect_sums(const BatchCase& of, std::size_t split = 0) {
  const std::vector<std::uint32_t> expected = sums_by_definition(of);
  const WindowTable table = window_table(of.penalties, of.side, of.window);
  with_every_set_of_instructions([&](const std::string& name) {
    EXPECT_EQ(summed(of, table, split), expected)
        << name << ", " << of.elements.from_pivot_mm.size() << " elements, side " << of.side;
  });
}

TEST(TilePenalties, AreTheSumsOfWindowsWithEverySetOfInstructions) {
  // Elements of which some see the map from none of the batch's tiles, and some from all.
  Uniform random(100);
  for (std::uint64_t trial = 0; trial < 300; ++trial) {
    const int side = 1 << static_cast<int>(random(0.0, 4.0));
    const auto elements = static_cast<std::size_t>(random(0.0, 70.0));
    BatchCase of = random_batch(elements, side, trial % 3 == 0 ? 8192 : 900, 1000 + trial);
    of.window = trial % 5 == 0 ? 1 : side + 1;  // as single bins have it
    of.first_x -= static_cast<int>(random(0.0, 40.0));
    of.first_y -= static_cast<int>(random(0.0, 20.0));
    of.penalties.beyond = static_cast<std::uint16_t>(random(0.0, 901.0));
    of.before = one_of(random, std::array{0U, 123456789U, largest_sum});
    expect_sums(of, static_cast<std::size_t>(random(0.0, static_cast<double>(elements) + 1.0)));
  }
}

TEST(TilePenalties, OfManyElementsNeitherWrapNorExceedTheLargestSum) {
  // 16 bits hold 7 of the largest penalties.
  for (const int side : {1, 8}) {
    for (const std::uint16_t largest : {std::uint16_t{0}, std::uint16_t{1}, largest_penalty}) {
      expect_sums(random_batch(1400, side, largest, 96));
    }
  }
  expect_sums(random_batch(300000, 1, 4000, 98));
  BatchCase of = random_batch(300000, 1, largest_penalty, 97);
  std::fill(of.penalties.least.begin(), of.penalties.least.end(), largest_penalty);
  ASSERT_EQ(sums_by_definition(of), std::vector<std::uint32_t>(batch_tiles, largest_sum));
  expect_sums(of);
  // Just below it.
  of.elements.from_pivot_mm.resize(largest_sum / largest_penalty - 1);
  ASSERT_LT(sums_by_definition(of).front(), largest_sum);
  expect_sums(of);
}

}  // namespace palpate::tile_penalties_test
