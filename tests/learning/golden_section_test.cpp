#include "learning/golden_section.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace palpate::golden_section_test {

TEST(GoldenSection, FindsTheLeastValue) {
  int calls = 0;
  const double found = least_at(-3.0, 7.0, 1e-6, [&](double x) {
    ++calls;
    return std::abs(x - 1.25);
  });
  EXPECT_NEAR(found, 1.25, 1e-6);
  // Each section leaves 0.618 of the interval: 34 for a factor of 1e7, and the two to begin with.
  EXPECT_LE(calls, 37);
}

TEST(GoldenSection, ReachesBothEnds) {
  EXPECT_NEAR(least_at(2.0, 5.0, 1e-4, [](double x) { return -x; }), 5.0, 1e-4);
  EXPECT_NEAR(least_at(2.0, 5.0, 1e-4, [](double x) { return x; }), 2.0, 1e-4);
}

TEST(GoldenSection, OfEqualValuesTakesTheLowest) {
  EXPECT_NEAR(least_at(0.0, 2.0, 1e-4, [](double) { return 3.0; }), 0.0, 1e-4);
}

}  // namespace palpate::golden_section_test
