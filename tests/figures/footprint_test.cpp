#include "footprint.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "palpate/pose.hpp"
#include "palpate/touch.hpp"

namespace palpate {
namespace {

double area(const std::vector<glm::dvec2>& polygon) {
  double twice = 0.0;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const glm::dvec2 a = polygon[k];
    const glm::dvec2 b = polygon[(k + 1) % polygon.size()];
    twice += a.x * b.y - a.y * b.x;
  }
  return twice / 2;
}

std::vector<glm::dvec2> at(const Pose& T, std::vector<glm::dvec2> points) {
  for (glm::dvec2& p : points) {
    p = T * p;
  }
  return points;
}

TEST(Footprint, OfTheDigiTactsRegionIsItsRectangleAtEveryPose) {
  for (double theta = 0.0; theta < 7.0; theta += 0.37) {
    const Footprint f = footprint(at({{30.0, -7.0}, theta}, digitacts_array()), 1.8);
    EXPECT_EQ(f.elements.size(), 36u);
    EXPECT_EQ(f.outline.size(), 4u) << "no corners along its sides";
    // 11.6 x 11.3 mm; rounding of the turned coordinates is all that may change it.
    EXPECT_NEAR(area(f.outline), 11.6 * 11.3, 1e-9) << theta;
  }
}

TEST(Footprint, KeepsItsCornersWhereRoundingFraysItsSides) {
  for (double theta = 0.0; theta < 7.0; theta += 0.1) {
    const Pose T{{2.5 + theta, -7.0}, theta};
    const Footprint f = footprint(at(inverse(T), at(T, digitacts_array())), 1.8);
    EXPECT_EQ(f.outline.size(), 4u) << theta;
    EXPECT_NEAR(area(f.outline), 11.6 * 11.3, 1e-9) << theta;
  }
}

TEST(Footprint, TurnsItsSquaresWithTheArray) {
  const Pose T{{3.0, 4.0}, 0.4};
  const Footprint f = footprint(at(T, digitacts_array()), 1.8);
  for (const auto& square : f.elements) {
    const glm::dvec2 edge = square[1] - square[0];
    // The array's own direction, or a right angle to it.
    EXPECT_NEAR(std::sin(2.0 * (std::atan2(edge.y, edge.x) - T.theta_rad)), 0.0, 1e-9);
  }
}

TEST(Footprint, OfOneElementIsASquare) {
  const std::vector<glm::dvec2> one{{2.0, 3.0}};
  const Footprint f = footprint(one, 1.8);
  ASSERT_EQ(f.elements.size(), 1u);
  EXPECT_EQ(f.outline.size(), 4u);
  EXPECT_NEAR(area(f.outline), 1.8 * 1.8, 1e-12);
}

TEST(Footprint, OfARowOfElementsLiesAlongTheRow) {
  const std::vector<glm::dvec2> row{{0.0, 0.0}, {3.0, 4.0}, {6.0, 8.0}};
  // 10 mm from end to end, and half an element beyond each.
  EXPECT_NEAR(area(footprint(row, 2.0).outline), 12.0 * 2.0, 1e-9);
}

TEST(Footprint, OfNothingIsEmpty) {
  const Footprint f = footprint({}, 1.8);
  EXPECT_TRUE(f.elements.empty());
  EXPECT_TRUE(f.outline.empty());
}

}  // namespace
}  // namespace palpate
