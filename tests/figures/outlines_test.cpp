#include "figures/outlines.hpp"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <glm/common.hpp>

#include "palpate/pose.hpp"
#include "palpate/touch.hpp"
#include "picture.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"

namespace palpate::outlines_test {

std::vector<glm::dvec2> at(const Pose& T, std::vector<glm::dvec2> points) {
  for (glm::dvec2& p : points) {
    p = T * p;
  }
  return points;
}

TEST(Footprint, OfTheDigiTactsRegionIsItsRectangleAtEveryPose) {
  for (double theta = 0.0; theta < 7.0; theta += 0.1) {
    const Pose T{{2.5 + theta, -7.0}, theta};
    // Turned there and back, where rounding frays the sides.
    for (const auto& elements :
         {at(T, digitacts_array()), at(inverse(T), at(T, digitacts_array()))}) {
      const Footprint f = footprint(elements, 1.8);
      EXPECT_EQ(f.elements.size(), 36u);
      EXPECT_EQ(f.outline.size(), 4u) << "no corners along its sides";
      // 11.6 x 11.3 mm; rounding of the turned coordinates is all that may change it.
      EXPECT_NEAR(area(f.outline), 11.6 * 11.3, 1e-9) << theta;
    }
  }
}

/// Area of the rectangle along this direction around the points.
double rectangle_around(const std::vector<glm::dvec2>& points, double angle_rad) {
  glm::dvec2 lower = rotate(-angle_rad, points.front());
  glm::dvec2 upper = lower;
  for (const glm::dvec2& p : points) {
    lower = glm::min(lower, rotate(-angle_rad, p));
    upper = glm::max(upper, rotate(-angle_rad, p));
  }
  return (upper.x - lower.x) * (upper.y - lower.y);
}

TEST(Footprint, LiesAlongTheSmallestRectangle) {
  Uniform random(20110509);
  for (int run = 0; run < 100; ++run) {
    std::vector<glm::dvec2> points(static_cast<std::size_t>(3 + run % 10));
    for (glm::dvec2& p : points) {
      // Every other time on a grid, where many points lie in one line.
      p = {random(-10.0, 10.0), random(-10.0, 10.0)};
      p = run % 2 == 0 ? p : glm::round(p / 5.0);
    }
    // One side of the smallest rectangle holds two of the points.
    double smallest = infinity;
    for (const glm::dvec2& a : points) {
      for (const glm::dvec2& b : points) {
        if (a != b) {
          smallest = std::min(smallest, rectangle_around(points, std::atan2(b.y - a.y, b.x - a.x)));
        }
      }
    }
    const auto square = footprint(points, 1.0).elements.front();
    const glm::dvec2 edge = square[1] - square[0];
    // Rounding of coordinates of 10 mm, turned.
    EXPECT_NEAR(rectangle_around(points, std::atan2(edge.y, edge.x)), smallest, 1e-11) << run;
  }
}

TEST(Footprint, OfOneElementOfARowAndOfNone) {
  const Footprint one = footprint(std::vector<glm::dvec2>{{2.0, 3.0}}, 1.8);
  ASSERT_EQ(one.elements.size(), 1u);
  EXPECT_EQ(one.outline.size(), 4u);
  EXPECT_NEAR(area(one.outline), 1.8 * 1.8, 1e-12);
  // A row of 10 mm from end to end, and half an element beyond each.
  const std::vector<glm::dvec2> row{{0.0, 0.0}, {3.0, 4.0}, {6.0, 8.0}};
  EXPECT_NEAR(area(footprint(row, 2.0).outline), 12.0 * 2.0, 1e-9);
  EXPECT_TRUE(footprint({}, 1.8).elements.empty() && footprint({}, 1.8).outline.empty());
}

/// Cells of 0.5 mm whose rows are given from below: '#' is occupied.
OccupancyGrid map_of(const std::vector<std::string>& rows) {
  OccupancyGrid map;
  map.origin_mm = {-1.0, 2.0};
  map.cell_mm = 0.5;
  map.nx = static_cast<int>(rows.front().size());
  map.ny = static_cast<int>(rows.size());
  for (const std::string& row : rows) {
    for (const char cell : row) {
      map.log_odds.push_back(cell == '#' ? 1.0F : -1.0F);
    }
  }
  return map;
}

TEST(MapOutline, RunsBetweenOccupiedCellsAndTheOthersWithCornersCutOff) {
  // In cells: a corner of the object lacks an eighth, one that it surrounds has an eighth more.
  const std::tuple<const char*, std::vector<std::string>, std::size_t, double> cases[] = {
      {"a block", {"......", ".####.", ".####.", "......"}, 1, 8.0 - 4.0 / 8.0},
      {"the grid's edges", {"##", "##"}, 1, 4.0 - 4.0 / 8.0},
      {"nothing", {"...", "..."}, 0, 0.0},
      {"no rectangle about it", {"#####", "#....", "#....", "#####"}, 1, 12.0 - 4.0 / 8.0},
      {"cells that meet at a corner", {"#.", ".#"}, 1, 2.0 - 4.0 / 8.0},
      {"a hole", {"####", "#..#", "#..#", "####", "....", "##.."}, 3, 14.0 - 4.0 / 8.0}};
  for (const auto& [name, rows, count, cells] : cases) {
    SCOPED_TRACE(name);
    const auto outlines = outlines_of(map_of(rows));
    EXPECT_EQ(outlines.size(), count);
    double sum = 0.0;
    for (const auto& outline : outlines) {
      sum += area(outline);
    }
    EXPECT_NEAR(sum, cells * 0.25, 1e-12);
    EXPECT_EQ(std::ranges::count_if(outlines, [](const auto& o) { return area(o) < 0.0; }),
              count == 3 ? 1 : 0);
  }
  EXPECT_EQ(outlines_of(map_of({"......", ".####.", ".####.", "......"}))[0].size(), 12U);
}

}  // namespace palpate::outlines_test
