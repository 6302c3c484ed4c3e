#include "cli/array_picture.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace palpate::cli::array_picture_test {

using Elements = std::vector<glm::dvec2>;

/// Half of the smallest distance that is not zero, by comparing all.
double half_pitch(const Elements& elements) {
  double least = std::numeric_limits<double>::infinity();
  for (const glm::dvec2& a : elements) {
    for (const glm::dvec2& b : elements) {
      least = a == b ? least : std::min(least, std::hypot(a.x - b.x, a.y - b.y));
    }
  }
  return 0.5 * least;
}

/// The first element whose square holds the point, by trying all.
std::optional<std::size_t> first_at(const Elements& elements, double half, const glm::dvec2& p) {
  for (std::size_t i = 0; i < elements.size(); ++i) {
    if (std::abs(p.x - elements[i].x) <= half && std::abs(p.y - elements[i].y) <= half) {
      return i;
    }
  }
  return {};
}

/// The same as by comparing all with all, at these points and on the corners of every square.
void expect_as_by_comparing_all(const Elements& elements, std::mt19937_64& random) {
  const ArrayPicture picture(elements);
  const double half = half_pitch(elements);
  EXPECT_EQ(picture.lower_mm().x + half, std::ranges::min_element(elements, {}, &glm::dvec2::x)->x);
  EXPECT_EQ(picture.upper_mm().y - half, std::ranges::max_element(elements, {}, &glm::dvec2::y)->y);
  Elements points;
  std::uniform_real_distribution<double> mm(-12.0, 12.0);
  for (int i = 0; i < 200; ++i) {
    points.emplace_back(mm(random), mm(random));
  }
  for (const glm::dvec2& p : elements) {
    points.insert(points.end(), {p, p - half, p + half, p + 0.999 * half, p + 1.001 * half});
  }
  for (const glm::dvec2& p : points) {
    EXPECT_EQ(picture.element_at(p), first_at(elements, half, p)) << p.x << ", " << p.y;
  }
}

TEST(ArrayPicture, IsTheSameAsByComparingAll) {
  std::mt19937_64 random(20110509);
  std::uniform_real_distribution<double> mm(-10.0, 10.0);
  // Whole numbers, so that all the squares' corners are exact: rows, a grid, a grid's every other
  // place, elements that coincide, and two that are far apart for their distance to the next.
  const Elements row{{0.0, 0.0}, {2.0, 0.0}, {4.0, 0.0}};
  Elements grid;
  Elements board;
  for (int i = 0; i < 49; ++i) {
    grid.emplace_back(i % 7 - 3.0, i / 7 - 3.0);
    if (i % 2 == 0) {
      board.push_back(grid.back());
    }
  }
  Elements twice = grid;
  twice.insert(twice.end(), grid.rbegin(), grid.rend());
  for (const Elements& elements : {row, grid, twice, Elements{{0, 0}, {1, 0}, {-1e6, 1e6}}}) {
    expect_as_by_comparing_all(elements, random);
  }
  for (int run = 0; run < 40; ++run) {
    Elements elements(2 + run);
    for (glm::dvec2& p : elements) {
      p = {mm(random), mm(random)};
    }
    const ArrayPicture picture(elements);
    for (int i = 0; i < 100; ++i) {
      const glm::dvec2 p{mm(random), mm(random)};
      EXPECT_EQ(picture.element_at(p), first_at(elements, half_pitch(elements), p));
    }
    for (std::size_t i = 0; i < elements.size(); ++i) {
      EXPECT_EQ(picture.element_at(elements[i]),
                first_at(elements, half_pitch(elements), elements[i]));
    }
  }
  const ArrayPicture diagonal(board);  // 1.41 mm apart
  for (const glm::dvec2& p : grid) {
    EXPECT_EQ(diagonal.element_at(p + 0.1), first_at(board, half_pitch(board), p + 0.1));
  }
}

TEST(ArrayPicture, OfOneElementIsTwoMillimetresWide) {
  const ArrayPicture picture({{3.0, 4.0}});
  EXPECT_EQ(picture.element_at({3.9, 3.1}), 0u);
  EXPECT_EQ(picture.element_at({4.1, 4.0}), std::nullopt);
  EXPECT_EQ(picture.upper_mm(), glm::dvec2(4.0, 5.0));
}

// 0.1 + 0.2 is not 0.3, and lists of elements are made by adding.
TEST(ArrayPicture, ElementsThatCoincideButForRoundingAreOne) {
  const Elements elements{{0.3, 0.1 + 0.2}, {0.1 + 0.2, 0.3}, {4.3, 0.3}, {0.3, 4.3}, {0.3, 0.3}};
  const ArrayPicture picture(elements);
  EXPECT_NEAR(picture.lower_mm().x, -1.7, 1e-9);  // 4 mm apart
  EXPECT_NEAR(picture.upper_mm().y, 6.3, 1e-9);
  EXPECT_EQ(picture.element_at({1.0, 1.0}), 0u);
  EXPECT_EQ(picture.element_at({4.0, 1.0}), 2u);
  EXPECT_EQ(picture.element_at({4.0, 4.0}), std::nullopt);
  const ArrayPicture alone({{0.3, 0.0}, {0.1 + 0.2, 0.0}});
  EXPECT_NEAR(alone.upper_mm().x, 1.3, 1e-9) << "as wide as of one element";
}

// Beyond 2^53 a row and the next one are the same number.
TEST(ArrayPicture, AnswersHoweverFarAwayThePointIs) {
  const ArrayPicture picture({{0.0, 0.0}, {1.0, 0.0}});
  for (const double far : {1e15, 1e16, 1e300}) {
    EXPECT_EQ(picture.element_at({0.0, far}), std::nullopt);
    EXPECT_EQ(picture.element_at({far, 0.0}), std::nullopt);
  }
}

TEST(ArrayPicture, OfNothingIsEmpty) {
  EXPECT_EQ(ArrayPicture({}).element_at({0.0, 0.0}), std::nullopt);
  EXPECT_EQ(ArrayPicture({{0.0, 0.0}, {0.0, 0.0}}).element_at({0.5, 0.5}), 0u);
}

}  // namespace palpate::cli::array_picture_test
