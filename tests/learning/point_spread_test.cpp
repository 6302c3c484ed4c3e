#include "learning/contact_learning.hpp"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "simulated_presses.hpp"

namespace palpate::point_spread_test {

constexpr ContactClassifier classifier{.threshold = 2.0, .ratio = 0.3};

class PointSpreadOfLetters : public testing::TestWithParam<double> {};

TEST_P(PointSpreadOfLetters, IsRecovered) {
  LetterPresses letters;
  letters.add("A", 80, 51, {.psf_mm = GetParam()});
  letters.add("R", 80, 52, {.psf_mm = GetParam()});
  letters.add("U", 80, 53, {.psf_mm = GetParam()});
  const auto found = learn_point_spread(letters.presses, classifier);
  ASSERT_TRUE(found.has_value());
  // Cells of an eighth of a spacing, 0.24 mm, make a narrow one wider.
  EXPECT_NEAR(*found, GetParam(), std::max(0.1 * GetParam(), 0.08));
}

INSTANTIATE_TEST_SUITE_P(All, PointSpreadOfLetters, testing::Values(0.4, 0.7, 1.0, 1.5));

TEST(PointSpread, IsTheLeastErrorOfSeveralMinima) {
  LetterPresses letters;
  letters.add("I", training_grid(), 3);
  const auto found = learn_point_spread(letters.presses, {.threshold = 2.12, .ratio = 0.377});
  ASSERT_TRUE(found.has_value());
  // One object, of few edges.
  EXPECT_NEAR(*found, 1.0, 0.15);
}

TEST(PointSpread, IgnoresDeadElements) {
  LetterPresses letters;
  letters.add("A", 80, 51);
  letters.recordings[0].valid.assign(36, 1);
  letters.recordings[0].valid[14] = 0;
  letters.make_presses(true);
  const auto expected = learn_point_spread(letters.presses, classifier);
  ASSERT_TRUE(expected.has_value());
  for (std::size_t i = 14; i < letters.recordings[0].pressure.size(); i += 36) {
    letters.recordings[0].pressure[i] = 300.0;
  }
  letters.make_presses(true);
  EXPECT_EQ(learn_point_spread(letters.presses, classifier), expected);
}

TEST(PointSpread, IsNoneOfFewTouches) {
  LetterPresses letters;
  letters.add("A", 9, 54);
  letters.add("R", 9, 55);
  EXPECT_FALSE(learn_point_spread(letters.presses, classifier).has_value());
}

TEST(PointSpread, IsNoneWithoutContact) {
  LetterPresses letters;
  letters.add("A", 20, 56);
  EXPECT_FALSE(learn_point_spread(letters.presses, {.threshold = 500.0}).has_value());
}

TEST(PointSpread, IsNoneOfASensorWithoutEdges) {
  // Every element reads the same: there is no edge to blur.
  LetterPresses letters;
  letters.add("A", 20, 57);
  letters.recordings[0].pressure.assign(letters.recordings[0].pressure.size(), 20.0);
  letters.make_presses(true);
  EXPECT_FALSE(learn_point_spread(letters.presses, classifier).has_value());
}

}  // namespace palpate::point_spread_test
