#include "figures/figures.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "figures/palette.hpp"
#include "palpate/error.hpp"
#include "picture.hpp"

namespace palpate::confusion_figure_test {

ConfusionFigure example() {
  return {.title = "7 of 12 right",
          .columns = {"A", "B", "(none)"},
          .rows = {{"A", "A", {4, 0, 0}, {1.0, 0.0, 0.0}},
                   {"B", "B", {3, 1, 0}, {0.75, 0.25, 0.0}},
                   {"M (unknown)", "(none)", {2, 0, 2}, {0.5, 0.0, 0.4}}}};
}

/// As many classes, all right.
ConfusionFigure diagonal(std::size_t classes) {
  ConfusionFigure figure;
  for (std::size_t k = 0; k < classes; ++k) {
    const std::string label = "class_" + std::to_string(k);
    figure.columns.push_back(label);
    figure.rows.push_back(
        {label, label, std::vector<std::size_t>(classes, 0), std::vector<double>(classes, 0.0)});
    figure.rows.back().counts[k] = 25;
    figure.rows.back().proven[k] = 1.0;
  }
  return figure;
}

int count(const Picture& picture, const Colour& colour) {
  return static_cast<int>(std::ranges::count(picture.pixels, rgb(colour)));
}

TEST(ConfusionFigure, GivesTheSameBytesAgain) {
  EXPECT_EQ(draw_confusion(example()), draw_confusion(example()));
}

TEST(ConfusionFigure, ColoursEveryCellByItsProvenShare) {
  const Picture picture = decode(draw_confusion(example()));
  // Cells of 84 pixels; numbers and frames cover some, and the colour bar adds a few.
  constexpr int cell = 84 * 84;
  EXPECT_NEAR(count(picture, diverging(-1.0)), cell, 0.1 * cell) << "A, always right";
  EXPECT_NEAR(count(picture, diverging(0.75)), cell, 0.1 * cell) << "B, taken for A";
  EXPECT_NEAR(count(picture, diverging(-0.25)), cell, 0.1 * cell) << "B";
  EXPECT_NEAR(count(picture, diverging(0.5)), cell, 0.1 * cell) << "M, taken for A";
  EXPECT_NEAR(count(picture, diverging(-0.4)), cell, 0.1 * cell) << "M, called (none)";
}

TEST(ConfusionFigure, WritesCountsInTheirCells) {
  ConfusionFigure figure = example();
  const Picture four = decode(draw_confusion(figure));
  figure.rows[0].counts[0] = 8;  // as large a share
  const Difference change = difference(four, decode(draw_confusion(figure)));
  EXPECT_GT(change.pixels, 10);
  EXPECT_LT(change.right - change.left, 20);
  EXPECT_LT(change.bottom - change.top, 24);
}

TEST(ConfusionFigure, StaysOfAPictureSizeForManyClasses) {
  const Picture twenty_two = decode(draw_confusion(diagonal(22)));
  EXPECT_LT(twenty_two.width, 1400);
  EXPECT_LT(twenty_two.height, 1400);
  const Picture many = decode(draw_confusion(diagonal(200)));
  EXPECT_LT(many.width, 2400);
  EXPECT_GT(count(many, diverging(-1.0)), 200 * 8 * 8);
}

TEST(ConfusionFigure, RefusesWhatItCannotDraw) {
  EXPECT_THROW(draw_confusion({}), Error);
  ConfusionFigure counts = example();
  counts.rows[1].counts.pop_back();
  EXPECT_THROW(draw_confusion(counts), Error);
  ConfusionFigure shares = example();
  shares.rows[1].proven.pop_back();
  EXPECT_THROW(draw_confusion(shares), Error);
}

}  // namespace palpate::confusion_figure_test
