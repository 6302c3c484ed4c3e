#include "figures/chart_axis.hpp"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace palpate::chart_axis_test {

using Labels = std::vector<std::string>;

Labels labels(const AxisSpan& span) {
  Labels result;
  for (const Tick& tick : span.ticks) {
    result.push_back(tick.label);
    EXPECT_GE(tick.value, span.lower - 1e-9);
    EXPECT_LE(tick.value, span.upper + 1e-9);
  }
  return result;
}

AxisSpan linear(const std::vector<double>& values, ChartAxis axis = {}) {
  return span_of(axis, values);
}

AxisSpan logarithmic(const std::vector<double>& values, ChartAxis axis = {}) {
  axis.scale = Scale::logarithmic;
  return span_of(axis, values);
}

TEST(LinearAxis, EndsAtWholeTicksAroundTheData) {
  const AxisSpan span = linear({-3.0, 12.0});
  EXPECT_EQ(span.lower, -5.0);
  EXPECT_EQ(span.upper, 15.0);
  EXPECT_EQ(labels(span), (Labels{"−5", "0", "5", "10", "15"}));
}

TEST(LinearAxis, KeepsTheEndsThatAreGiven) {
  const AxisSpan span = linear({-3.0, 99.0}, {.label = {}, .lower = 0.0, .upper = 105.0});
  EXPECT_EQ(span.lower, 0.0);
  EXPECT_EQ(span.upper, 105.0);
  EXPECT_EQ(labels(span), (Labels{"0", "20", "40", "60", "80", "100"}));
}

TEST(LogarithmicAxis, LabelsTwoAndFiveOfAFewDecades) {
  const AxisSpan span = logarithmic({0.1, 10.0});
  EXPECT_EQ(labels(span), (Labels{"0.1", "0.2", "0.5", "1", "2", "5", "10"}));
  EXPECT_LT(span.lower, -1.0) << "room for the mark at 0.1";
  EXPECT_GT(span.upper, 1.0);
  EXPECT_EQ(span.place(100.0), 2.0);
}

TEST(LogarithmicAxis, LabelsAtMostElevenOfManyDecades) {
  for (const double decades : {4.0, 9.0, 25.0, 120.0, 500.0}) {
    const AxisSpan span = logarithmic({1.0, std::pow(10.0, 0.6 * decades)});
    EXPECT_GE(span.ticks.size(), 2u) << decades;
    EXPECT_LE(span.ticks.size(), 11u) << decades;
  }
}

TEST(LogarithmicAxis, HasTicksHoweverShortItIs) {
  for (const double factor : {1.0001, 1.01, 1.33, 2.0, 5.0}) {
    for (const double lower : {1.2, 3.1, 0.0097}) {
      EXPECT_GE(labels(logarithmic({lower, factor * lower})).size(), 2u) << lower << ", " << factor;
    }
  }
}

TEST(LogarithmicAxis, HasNoPlaceForZeroAndBelow) {
  const AxisSpan span = logarithmic({0.0, -4.0, 1.0, NAN, INFINITY});
  EXPECT_FALSE(span.has(0.0));
  EXPECT_FALSE(span.has(-1.0));
  EXPECT_FALSE(span.has(NAN));
  EXPECT_TRUE(span.has(1e-300));
  EXPECT_LT(span.upper - span.lower, 0.2) << "1 is the only value";
}

TEST(Axis, WithoutDataHasTicksAndAnExtent) {
  for (const AxisSpan& span : {linear({}), logarithmic({}), linear({7.0}), logarithmic({7.0})}) {
    EXPECT_LT(span.lower, span.upper);
    EXPECT_FALSE(span.ticks.empty());
  }
}

TEST(Axis, WritesTicksByItsOwnText) {
  ChartAxis axis;
  axis.text = [](double value) { return std::to_string(static_cast<int>(value)) + " s"; };
  EXPECT_EQ(labels(linear({0.0, 2.0}, axis)).front(), "0 s");
}

}  // namespace palpate::chart_axis_test
