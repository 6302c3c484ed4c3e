#include "learning/press_fusion.hpp"

#include <gtest/gtest.h>

namespace palpate::press_fusion_test {

/// Presses 0 to 2 are alike, 3 and 4 are, 5 is like none.
FitTable sample_table() {
  return {.columns = {0, 1, 3, 5},
          .fit = {{1.0, 0.9, 0.1, 0.0},
                  {0.8, 1.0, 0.0, 0.0},
                  {0.6, 0.9, 0.1, 0.1},
                  {0.0, 0.1, 1.0, 0.0},
                  {0.1, 0.0, 0.7, 0.2},
                  {0.0, 0.0, 0.0, 1.0}}};
}

TEST(NextMap, IsTheOneThatMostPressesFit) {
  std::vector<double> best(6, 0.0);
  EXPECT_EQ(next_map(sample_table(), best, 0.5), 1u);
  best = {0.9, 1.0, 0.9, 0.1, 0.0, 0.0};
  EXPECT_EQ(next_map(sample_table(), best, 0.5), 2u);
  best = {0.9, 1.0, 0.9, 1.0, 0.7, 0.0};
  EXPECT_EQ(next_map(sample_table(), best, 0.5), 3u);
}

TEST(NextMap, NoneWhereAllPressesFit) {
  EXPECT_FALSE(next_map(sample_table(), std::vector<double>(6, 0.5), 0.5));
}

}  // namespace palpate::press_fusion_test
