#include "sweep_findings.hpp"

#include <gtest/gtest.h>

#include "svg_chart.hpp"

namespace palpate::bench {
namespace {

/// A run of two letters with these errors, letter by letter; below 0 where it located nothing.
SweepPoint run_of(std::int64_t count, const std::vector<double>& errors_mm) {
  SweepPoint run{.filter = "histogram", .count = count};
  for (const double error_mm : errors_mm) {
    run.scores.push_back({.error_mm = error_mm < 0.0 ? std::nullopt : std::optional(error_mm)});
  }
  return run;
}

TEST(ParetoFront, KeepsWhatNothingBeats) {
  const std::vector<CostAndError> entries = {{3.0, 1.0}, {1.0, 5.0}, {2.0, 5.0},
                                             {2.0, 2.0}, {4.0, 1.0}, {3.0, 1.0}};
  EXPECT_EQ(pareto_front(entries), (std::vector<std::size_t>{1, 3, 0}))
      << "by rising cost, the first of equals";
  EXPECT_TRUE(pareto_front({}).empty());
}

TEST(PairedErrors, CompareTheTrialsThatBothLocated) {
  // The second run has one trial per letter: the first of each of the other's.
  const PairedErrors paired =
      paired_errors(run_of(10, {1.0, 9.0, 3.0, 9.0}), run_of(100, {0.5, 0.7}), 2, false);
  EXPECT_EQ(paired.trials, 2);
  EXPECT_DOUBLE_EQ(paired.first_mm, 2.0);
  EXPECT_DOUBLE_EQ(paired.second_mm, 0.6);
  const PairedErrors one =
      paired_errors(run_of(10, {1.0, 9.0, 3.0, 9.0}), run_of(100, {0.5, -1.0}), 2, false);
  EXPECT_EQ(one.trials, 1);
  EXPECT_DOUBLE_EQ(one.first_mm, 1.0);
  EXPECT_EQ(paired_errors(run_of(10, {1.0, 1.0}), run_of(100, {1.0, 1.0}), 2, true).trials, 0)
      << "no refined poses";
}

TEST(Knee, IsTheFirstRunThatNoFinerOneBeatsByMuch) {
  const std::vector<SweepPoint> runs = {run_of(10, {4.0, 4.0}), run_of(100, {1.09, 1.09}),
                                        run_of(1'000, {1.05, 1.05}), run_of(10'000, {1.0, 1.0})};
  EXPECT_EQ(knee_of(runs, 2, false), 1U);
  EXPECT_EQ(knee_of(std::span(runs).first(2), 2, false), std::nullopt)
      << "the last run has no finer one";
  EXPECT_EQ(knee_of(runs, 2, true), std::nullopt) << "no refined poses";
  EXPECT_EQ(knee_of({}, 2, false), std::nullopt);
}

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++count;
  }
  return count;
}

TEST(Chart, DrawsEveryPointThatALogarithmicAxisHolds) {
  Chart chart{.title = "a < b & c",
              .x_label = "x",
              .y_label = "y",
              .x_tick = [](double x) { return std::to_string(x); },
              .y_tick = [](double y) { return std::to_string(y); },
              .series = {{.name = "one",
                          .points = {{1.0, 1.0, "first", "title \"1\""},
                                     {1e3, 1e-3, "second", "title 2"},
                                     {0.0, 1.0, "none", "on no such axis"},
                                     {1.0, -1.0, "none", "on no such axis"}}}}};
  const std::string svg = svg_of(chart);
  // The legend has a mark, too.
  EXPECT_EQ(count_of(svg, "<circle"), 3U);
  EXPECT_EQ(svg.find("no such axis"), std::string::npos);
  EXPECT_NE(svg.find("a &lt; b &amp; c"), std::string::npos);
  EXPECT_NE(svg.find("title &quot;1&quot;"), std::string::npos);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  chart.series.clear();
  EXPECT_EQ(svg_of(chart).find("nan"), std::string::npos) << "an empty chart has axes";
  EXPECT_NE(svg_file(chart).find("xmlns"), std::string::npos);
}

}  // namespace
}  // namespace palpate::bench
