#include "figures/figures.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "figures/palette.hpp"
#include "picture.hpp"

namespace palpate::reliability_figure_test {

ReliabilityFigure example() {
  return {.curves = {
              {.name = "all", .points = {{0.55, 0.5, 0.3, 0.7, 20}, {0.95, 0.9, 0.8, 0.95, 80}}}}};
}

TEST(ReliabilityFigure, GivesTheSameBytesAgain) {
  EXPECT_EQ(draw_reliability(example()), draw_reliability(example()));
}

TEST(ReliabilityFigure, APointMovesWithItsAccuracy) {
  ReliabilityFigure figure = example();
  const Picture before = decode(draw_reliability(figure));
  figure.curves[0].points[0].accuracy = 0.6;
  const Difference change = difference(before, decode(draw_reliability(figure)));
  // 640 pixels for -0.02 to 1.05.
  EXPECT_GT(change.bottom - change.top, 0.1 * 640 / 1.07);
  EXPECT_LT(change.bottom - change.top, 0.5 * 640);
}

TEST(ReliabilityFigure, WritesTheNumberOfRecordsBesideAPoint) {
  ReliabilityFigure figure = example();
  const Picture before = decode(draw_reliability(figure));
  figure.curves[0].points[0].records = 21;
  const Difference change = difference(before, decode(draw_reliability(figure)));
  EXPECT_GT(change.pixels, 5);
  EXPECT_LT(change.right - change.left, 30);
}

TEST(ReliabilityFigure, CurvesHaveColoursOfTheirOwn) {
  ReliabilityFigure figure = example();
  const auto second = [](const ReliabilityFigure& of) {
    return std::ranges::count(decode(draw_reliability(of)).pixels, rgb(series(1)));
  };
  EXPECT_EQ(second(figure), 0);
  figure.curves.push_back({.name = "known classes", .points = {{0.3, 0.9, 0.7, 0.95, 20}}});
  EXPECT_GT(second(figure), 100);
}

}  // namespace palpate::reliability_figure_test
