#include "recognition/recognition_task.hpp"

#include <gtest/gtest.h>

#include "shapes.hpp"

namespace palpate::recognition_task_test {

TEST(RecognitionTask, NamesEachLabelOnceAndNoneLast) {
  std::vector<Hypothesis> three = shapes();
  three.push_back(three[0]);
  const RecognitionTask known(three, HistogramOptions{});
  EXPECT_EQ(known.labels, (std::vector<std::string>{"L", "disc"}));
  EXPECT_EQ(known.label_of, (std::vector<std::size_t>{0, 1, 0}));
  const RecognitionTask with_none(three, HistogramOptions{.none_weight = 2.0});
  EXPECT_EQ(with_none.labels, (std::vector<std::string>{"L", "disc", "(none)"}));
  const RecognitionTask bounded_with_none(three, BoundedOptions{.none_weight = 2.0});
  EXPECT_EQ(bounded_with_none.labels, with_none.labels);
}

TEST(RecognitionTask, CountsBinsBeyondEveryInteger) {
  constexpr int many = 2'000'000'000;
  const PoseLattice lattice{
      .x_mm = {.count = many}, .y_mm = {.count = many}, .theta_rad = {.count = many}};
  const RecognitionTask task(shapes(), HistogramOptions{.lattice = lattice});
  EXPECT_GT(task.bins_in_all(), 1'000'000'000'000'000'000);
}

}  // namespace palpate::recognition_task_test
