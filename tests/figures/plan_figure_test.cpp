#include "figures/figures.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "figures/palette.hpp"
#include "palpate/error.hpp"
#include "palpate/touch.hpp"
#include "picture.hpp"

namespace palpate::plan_figure_test {

/// 60 x 40 mm, an object in the left half, three candidates.
PlanFigure example() {
  PlanFigure figure;
  figure.result = "u.h5: E (98.0 %)";
  figure.captions = {"after 2 touches"};
  figure.gain_caption = "expected information, nats";
  figure.lower_mm = {-30.0, -20.0};
  figure.nx = 60;
  figure.ny = 40;
  for (int j = 0; j < figure.ny; ++j) {
    for (int i = 0; i < figure.nx; ++i) {
      figure.occupied.push_back(i < 30 ? 1.0 : 0.0);
    }
  }
  figure.candidates = {
      {{{15.0, 5.0}, 0.4}, 2.0}, {{{20.0, -8.0}, 1.0}, 1.0}, {{{5.0, 12.0}, 0}, 0}};
  figure.elements_mm = digitacts_array();
  return figure;
}

int count(const Picture& picture, const Colour& colour) {
  return static_cast<int>(std::ranges::count(picture.pixels, rgb(colour)));
}

TEST(PlanFigure, GivesTheSameBytesAgain) { EXPECT_EQ(draw_plan(example()), draw_plan(example())); }

TEST(PlanFigure, ShadesTheHalfThatTheObjectFills) {
  PlanFigure figure = example();
  const Colour full{0.45, 0.45, 0.45};
  const int half = count(decode(draw_plan(figure)), full);
  std::ranges::fill(figure.occupied, 1.0);
  const int whole = count(decode(draw_plan(figure)), full);
  // 760 x 507 pixels; the best array's squares and the needles cover some 13,000, and the legend
  // adds 400.
  EXPECT_NEAR(half, 380 * 507, 4000) << "the candidates lie in the other half";
  EXPECT_NEAR(whole, 760 * 507, 20000);
}

TEST(PlanFigure, DrawsEveryCandidateInTheColourOfItsGain) {
  const PlanFigure figure = example();
  const Picture all = decode(draw_plan(figure));
  PlanFigure fewer = figure;
  fewer.candidates[1].T_robot_sensor.translation_mm = {500.0, 500.0};  // beyond the plot
  const Picture without = decode(draw_plan(fewer));
  const Difference change = difference(all, without);
  EXPECT_GT(change.pixels, 50);
  // (20, -8) mm: the plot's left edge is at 124 pixels, its top at 214, 760 / 60 pixels a mm.
  const double pitch = 760.0 / 60.0;
  EXPECT_NEAR(0.5 * (change.left + change.right), 124.0 + 50.0 * pitch, 15.0);
  EXPECT_NEAR(0.5 * (change.top + change.bottom), 214.0 + 28.0 * pitch, 15.0);
  EXPECT_GT(count(all, sequential(0.5)) - count(without, sequential(0.5)), 20);
}

TEST(PlanFigure, TouchesSoFarAreFaintOutlines) {
  PlanFigure figure = example();
  const Picture none = decode(draw_plan(figure));
  auto& touch = figure.touches_mm.emplace_back();
  for (const glm::dvec2& element : digitacts_array()) {
    touch.push_back(element + glm::dvec2(-15.0, 0.0));
  }
  const Difference change = difference(none, decode(draw_plan(figure)));
  const double pitch = 760.0 / 60.0;
  EXPECT_GT(change.pixels, 100);
  EXPECT_NEAR(change.right - change.left, 11.6 * pitch, 4.0);
  EXPECT_NEAR(0.5 * (change.left + change.right), 124.0 + 15.0 * pitch, 3.0);
}

TEST(PlanFigure, EqualGainsHaveAScaleToo) {
  PlanFigure figure = example();
  for (PlanFigure::Candidate& candidate : figure.candidates) {
    candidate.gain_nats = 0.0;
  }
  EXPECT_GT(decode(draw_plan(figure)).width, 700);
}

TEST(PlanFigure, RefusesWhatItCannotDraw) {
  PlanFigure none = example();
  none.candidates.clear();
  EXPECT_THROW(draw_plan(none), Error);
  PlanFigure no_array = example();
  no_array.elements_mm.clear();
  EXPECT_THROW(draw_plan(no_array), Error);
  PlanFigure cells = example();
  cells.occupied.pop_back();
  EXPECT_THROW(draw_plan(cells), Error);
}

}  // namespace palpate::plan_figure_test
