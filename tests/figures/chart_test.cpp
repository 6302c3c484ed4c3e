#include "figures/chart.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "picture.hpp"

namespace palpate::chart_test {

const Colour red{1.0, 0.0, 0.0};
const Colour blue{0.0, 0.0, 1.0};

Picture drawn(const Chart& chart) { return decode(draw_chart(chart)); }

int count_of(const Picture& picture, const Colour& colour) {
  return static_cast<int>(std::count(picture.pixels.begin(), picture.pixels.end(), rgb(colour)));
}

Chart chart_of(ChartSeries series) {
  Chart chart{.x = {.label = "x", .lower = 0.0, .upper = 10.0},
              .y = {.label = "y", .lower = 0.0, .upper = 10.0}};
  chart.series.push_back(std::move(series));
  return chart;
}

/// The middle of all pixels of a colour.
glm::dvec2 middle_of(const Picture& picture, const Colour& colour) {
  glm::dvec2 sum(0.0);
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      sum += picture.at(x, y) == rgb(colour) ? glm::dvec2(x, y) : glm::dvec2(0.0);
    }
  }
  return sum / static_cast<double>(count_of(picture, colour));
}

TEST(Chart, DrawsMarksOfEveryShapeAtTheirPoints) {
  for (const Mark mark : {Mark::circle, Mark::square}) {
    Chart chart = chart_of({.colour = red, .mark = mark, .points = {{.x = 2.0, .y = 8.0}}});
    chart.series.push_back({.colour = blue, .mark = mark, .points = {{.x = 9.0, .y = 1.0}}});
    const Picture picture = drawn(chart);
    EXPECT_GT(count_of(picture, red), 50);
    EXPECT_GT(count_of(picture, blue), 50);
    EXPECT_LT(middle_of(picture, red).x, middle_of(picture, blue).x);
    EXPECT_LT(middle_of(picture, red).y, middle_of(picture, blue).y) << "y points up";
  }
}

TEST(Chart, DrawsIntervalsAsBars) {
  ChartSeries series{.name = "", .colour = red, .mark = Mark::none};
  for (double x = 1.0; x <= 9.0; ++x) {
    series.points.push_back({.x = x, .y = 5.0, .low = 3.0, .high = 7.0});
  }
  const int bars = count_of(drawn(chart_of(series)), red);
  EXPECT_GT(bars, 9 * 200) << "nine bars of two fifths of the axis";
}

TEST(Chart, NamesSeriesAboveTheAxesInRowsAsNeeded) {
  Chart chart = chart_of({.name = "one", .colour = red});
  const int one_row = drawn(chart).height;
  EXPECT_GT(count_of(drawn(chart), red), 100) << "the legend has a mark";
  for (int i = 0; i < 12; ++i) {
    chart.series.push_back({.name = "another series of this chart", .colour = blue});
  }
  EXPECT_GT(drawn(chart).height, one_row + 60);
}

TEST(Chart, LabelsDoNotCoverEachOther) {
  ChartSeries series{.name = "", .colour = red, .mark = Mark::none};
  series.points.assign(1, {.x = 5.0, .y = 5.0, .label = "8888"});
  const int one = count_of(drawn(chart_of(series)), red);
  ASSERT_GT(one, 0);
  series.points.assign(40, series.points.front());
  const int many = count_of(drawn(chart_of(series)), red);
  EXPECT_GT(many, 2 * one);
  EXPECT_LE(many, 6.2 * one) << "there are six places around a point";
}

TEST(Chart, DrawsItsRuleFromBottomToTop) {
  Chart chart = chart_of({.name = "", .points = {}});
  const Picture without = drawn(chart);
  chart.rule = 2.5;
  const Picture left = drawn(chart);
  chart.rule = 7.5;
  const Picture right = drawn(chart);
  // Dots of a third of the way, less their blurred ends.
  EXPECT_GT(count_of(left, comparison_grey), count_of(without, comparison_grey) + 100);
  EXPECT_GT(count_of(right, comparison_grey), count_of(without, comparison_grey) + 100);
  EXPECT_LT(middle_of(left, comparison_grey).x, middle_of(right, comparison_grey).x);
}

TEST(Chart, HasTicksOfItsOwnAndALabelForEachSideOfItsRule) {
  Chart chart = chart_of({.name = "", .points = {}});
  chart.rule = 2.5;
  const Picture one_label = drawn(chart);
  chart.left_of_rule = "left";
  const Difference labels = difference(one_label, drawn(chart));
  EXPECT_LT(labels.left, one_label.width / 4) << "the left part's";
  EXPECT_GT(labels.right, one_label.width / 2) << "the label of x moves into its own part";
  const Picture round = drawn(chart);
  chart.x.ticks = {{5.0, "half"}};
  EXPECT_GT(difference(round, drawn(chart)).pixels, 500) << "ten lines go, and their numbers";
}

TEST(Chart, WithoutAnythingToShowHasAxes) {
  EXPECT_GT(count_of(drawn({.x = {.label = "x"}, .y = {.label = "y"}}), ink), 100);
}

}  // namespace palpate::chart_test
