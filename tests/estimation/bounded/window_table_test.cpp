#include "estimation/bounded/tables/window_table.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include <gtest/gtest.h>

#include "random_penalties.hpp"

namespace palpate::window_table_test {

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

}  // namespace palpate::window_table_test
