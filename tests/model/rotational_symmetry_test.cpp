#include "palpate/occupancy_grid.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <gtest/gtest.h>

#include "palpate/simulation.hpp"

namespace palpate::rotational_symmetry_test {

/// The map of a shape that is turned about a point off its middle: 4 nats on the shape and -4
/// beside it, within 17 mm of the origin.
OccupancyGrid map_of(const Shape& shape, double turn_rad = 0.0, double cell_mm = 0.5) {
  const int n = static_cast<int>(std::lround(34.0 / cell_mm)) + 1;
  OccupancyGrid map{.label = shape.label,
                    .cell_mm = cell_mm,
                    .origin_mm = {-17.0, -17.0},
                    .spread_mm = 0.5,
                    .nx = n,
                    .ny = n};
  const Pose T_shape_map = Pose{{0.4, -0.3}, 0.0} * Pose{{}, turn_rad};
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      map.log_odds.push_back(shape.contains(T_shape_map * map.centre_mm(i, j)) ? 4.0F : -4.0F);
    }
  }
  return map;
}

/// A regular polygon.
Shape polygon(int corners, double radius_mm) {
  Shape shape{.label = "polygon", .strokes = {}, .polygons = {{}}};
  for (int k = 0; k < corners; ++k) {
    const double a = 2.0 * std::numbers::pi * k / corners;
    shape.polygons.front().push_back(radius_mm * glm::dvec2(std::cos(a), std::sin(a)));
  }
  return shape;
}

int suggested(const OccupancyGrid& map) {
  const auto symmetry = measure_symmetry(map);
  EXPECT_TRUE(symmetry);
  return symmetry ? symmetry->suggested : -1;
}

TEST(RotationalSymmetry, OfTheCharactersIsTheirOwn) {
  // X is taller than wide, 0 an oval; B, M and 8 are nearly 2-fold, Q and G nearly full.
  for (const auto& [names, n] :
       {std::pair{"HINSXZ0", 2}, std::pair{"O", 0}, std::pair{"ABCDEFGJKLMPQRTUVWY123456789", 1}}) {
    for (const char name : std::string(names)) {
      const Shape shape = make_shape(std::string(1, name));
      EXPECT_EQ(suggested(map_of(shape)), n) << name;
      EXPECT_EQ(suggested(map_of(shape, 0.4)), n) << name << ", turned";
    }
  }
}

TEST(RotationalSymmetry, OfRegularPolygonsIsTheNumberOfTheirCorners) {
  for (const int corners : {3, 4, 5, 6}) {
    for (const double turn_rad : {0.0, 0.3}) {
      EXPECT_EQ(suggested(map_of(polygon(corners, 13.0), turn_rad)), corners);
    }
  }
  EXPECT_EQ(suggested(map_of(polygon(90, 9.0))), 0) << "a disc";
  EXPECT_EQ(suggested(map_of(make_shape("ring"))), 0);
  EXPECT_EQ(suggested(map_of(make_shape("bar"))), 2);
}

TEST(RotationalSymmetry, IsMeasuredAsTheDistanceOfTheOutlines) {
  const auto square = measure_symmetry(map_of(polygon(4, 13.0), 0.2));
  ASSERT_TRUE(square);
  // A square turned by 45 degrees leaves four corners of another of side 2 a uncovered, of the area
  // a^2 (sqrt(2) - 1)^2. At an edge, the measure forgives a part of a cell of 0.5 mm.
  const double a = 13.0 / std::numbers::sqrt2;
  const double corners_mm2 = 4.0 * a * a * std::pow(std::numbers::sqrt2 - 1.0, 2);
  EXPECT_NEAR(square->apart_mm[8], 2.0 * corners_mm2 / (8.0 * a), 0.25);
  EXPECT_LT(square->apart_mm[4], 0.1);  // a fifth of a cell
  EXPECT_EQ(square->apart_mm[1], 0.0);
  EXPECT_EQ(square->nearest(), 2) << "of 2 and 4, whose turns include those of 2";
  EXPECT_DOUBLE_EQ(square->tolerance_mm, 0.25);
}

TEST(RotationalSymmetry, OfManyCellsIsSampled) {
  // 681 x 681 cells.
  for (const auto& [label, n] : {std::pair("S", 2), {"B", 1}}) {
    const OccupancyGrid map = map_of(make_shape(label), 0.7, 0.05);
    EXPECT_GT(std::ranges::count(map.log_odds, 4.0F), 90'000) << label;
    EXPECT_EQ(suggested(map), n) << label;
  }
}

TEST(RotationalSymmetry, IsNoneOfAlmostNothing) {
  OccupancyGrid map = map_of(make_shape("I"));
  std::ranges::fill(map.log_odds, -4.0F);
  EXPECT_FALSE(measure_symmetry(map));
  std::fill_n(map.log_odds.begin() + 2000, 15, 4.0F);
  EXPECT_FALSE(measure_symmetry(map));
  map.log_odds[2015] = 4.0F;
  EXPECT_TRUE(measure_symmetry(map));
}

TEST(RotationalSymmetry, ComparesOnlyWhatWasSeen) {
  OccupancyGrid map = map_of(make_shape("I"));
  const auto unseen = static_cast<float>(map.prior_log_odds());
  std::fill_n(map.log_odds.begin(), map.ny / 4 * map.nx, unseen);
  EXPECT_EQ(suggested(map), 2) << "where the end of the I is not seen";
  // Without a cell that was seen to be free, nothing contradicts a turn; but it must not carry the
  // object to where nothing was seen.
  OccupancyGrid bare = map_of(make_shape("J"));
  std::ranges::replace(bare.log_odds, -4.0F, unseen);
  EXPECT_EQ(suggested(bare), 1);
}

TEST(MirrorSymmetry, IsThatOfTheLettersThatHaveAnAxis) {
  for (const double turn_rad : {0.4, 2.0}) {
    for (const auto& [letters, alike] : {std::pair{"AEIOUTHX", true}, {"FLPRSZNJ", false}}) {
      for (const char letter : std::string(letters)) {
        const auto sides =
            measure_mirror_symmetry(map_of(make_shape(std::string(1, letter)), turn_rad));
        ASSERT_TRUE(sides) << letter;
        EXPECT_EQ(sides->alike(), alike) << letter << ": " << sides->apart_mm;
        if (!alike) {
          EXPECT_GT(sides->apart_mm, 1.2 * sides->tolerance_mm) << letter;
        }
      }
    }
  }
}

}  // namespace palpate::rotational_symmetry_test
