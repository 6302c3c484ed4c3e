#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "figures/axes.hpp"
#include "figures/chart.hpp"

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

TEST(Axis, EndsAtWholeTicksAroundTheData) {
  const AxisSpan span = linear({-3.0, 12.0});
  EXPECT_EQ(span.lower, -5.0);
  EXPECT_EQ(span.upper, 15.0);
  EXPECT_EQ(labels(span), (Labels{"−5", "0", "5", "10", "15"}));
}

TEST(Axis, KeepsTheEndsThatAreGiven) {
  const AxisSpan span = linear({-3.0, 99.0}, {.label = {}, .lower = 0.0, .upper = 105.0});
  EXPECT_EQ(span.lower, 0.0);
  EXPECT_EQ(span.upper, 105.0);
  EXPECT_EQ(labels(span), (Labels{"0", "20", "40", "60", "80", "100"}));
}

TEST(Axis, WithoutDataHasTicksAndAnExtent) {
  for (const AxisSpan& span : {linear({}), linear({NAN}), linear({7.0})}) {
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
