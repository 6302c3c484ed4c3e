#include <algorithm>
#include <bitset>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <glm/common.hpp>

#include "palpate/error.hpp"
#include "palpate/pose.hpp"
#include "palpate/simulation.hpp"

namespace palpate::shape_test {

constexpr double half_box_mm = 12.5;

std::vector<std::string> names() {
  std::vector<std::string> all;
  for (const char c : std::string("ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789")) {
    all.push_back({c});
  }
  all.push_back("ring");
  all.push_back("bar");
  return all;
}

// A 0.5 mm raster over 40 x 40 mm.
constexpr int side = 80;
constexpr double pitch_mm = 0.5;

glm::dvec2 cell_centre_mm(int cell) {
  return pitch_mm * glm::dvec2(cell % side + 0.5 - side / 2.0, cell / side + 0.5 - side / 2.0);
}

using Raster = std::bitset<side * side>;

/// Whether the centre of each cell lies on the shape.
Raster rasterize(const Shape& shape) {
  Raster on;
  for (int cell = 0; cell < side * side; ++cell) {
    on[cell] = shape.contains(cell_centre_mm(cell));
  }
  return on;
}

/// The cell under each cell's centre after a turn about the origin; -1 beyond the raster.
std::vector<int> turned_cells(double theta_rad) {
  std::vector<int> cells;
  for (int cell = 0; cell < side * side; ++cell) {
    const glm::dvec2 p = rotate(theta_rad, cell_centre_mm(cell)) / pitch_mm + side / 2.0;
    const bool inside = p.x >= 0.0 && p.x < side && p.y >= 0.0 && p.y < side;
    cells.push_back(inside ? static_cast<int>(p.y) * side + static_cast<int>(p.x) : -1);
  }
  return cells;
}

Raster turned(const Raster& raster, const std::vector<int>& turned_cells) {
  Raster on;
  for (int cell = 0; cell < side * side; ++cell) {
    on[cell] = turned_cells[cell] >= 0 && raster[turned_cells[cell]];
  }
  return on;
}

TEST(Shape, EveryNamedShapeExistsUnderItsLabel) {
  for (const std::string& name : names()) {
    const Shape shape = make_shape(name);
    EXPECT_EQ(shape.label, name);
    EXPECT_NE(shape.strokes.size() + shape.polygons.size(), 0U) << name;
  }
}

TEST(Shape, EveryShapeIsCentredInTheBoxAndGlyphsFillItsHeight) {
  for (const std::string& name : names()) {
    const Shape shape = make_shape(name);
    glm::dvec2 lower{0.0};
    glm::dvec2 upper{0.0};
    const auto include = [&](const glm::dvec2& p, double radius_mm) {
      lower = glm::min(lower, p - radius_mm);
      upper = glm::max(upper, p + radius_mm);
    };
    for (const Shape::Stroke& stroke : shape.strokes) {
      for (const glm::dvec2& p : stroke.points_mm) {
        include(p, stroke.width_mm / 2.0);
      }
    }
    for (const std::vector<glm::dvec2>& polygon : shape.polygons) {
      for (const glm::dvec2& p : polygon) {
        include(p, 0.0);
      }
    }
    // 1e-9: rounding only.
    EXPECT_NEAR(lower.x, -upper.x, 1e-9) << name;
    EXPECT_NEAR(lower.y, -upper.y, 1e-9) << name;
    EXPECT_LE(std::max(upper.x, upper.y), half_box_mm + 1e-9) << name;
    if (name.size() == 1) {
      // An arc's chords may pass by its highest point, by less than 0.002 mm.
      EXPECT_NEAR(upper.y, half_box_mm, 0.002) << name;
    }
  }
}

TEST(Shape, NoTwoShapesAreAlikeInAnyRotation) {
  std::vector<Raster> rasters;
  for (const std::string& name : names()) {
    rasters.push_back(rasterize(make_shape(name)));
  }
  for (int degrees = 0; degrees < 360; degrees += 10) {
    const std::vector<int> cells = turned_cells(degrees * std::numbers::pi / 180.0);
    for (std::size_t b = 1; b < rasters.size(); ++b) {
      const Raster other = turned(rasters[b], cells);
      for (std::size_t a = 0; a < b; ++a) {
        // Nine elements of the array. The closest are A and V upside down, with 36 mm^2.
        EXPECT_GT((rasters[a] ^ other).count() * pitch_mm * pitch_mm, 30.0)
            << names()[a] << " and " << names()[b] << " at " << degrees << " degrees";
      }
    }
  }
}

TEST(Shape, OIsARingAndSymmetricUnderEveryRotation) {
  const Shape o = make_shape("O");
  for (int degrees = 0; degrees < 360; ++degrees) {
    const double a = degrees * std::numbers::pi / 180.0;
    const glm::dvec2 out{std::cos(a), std::sin(a)};
    // Centre line at 10.25 mm, 4.5 mm wide; 0.01 mm for the polyline's chords.
    EXPECT_FALSE(o.contains(7.99 * out)) << degrees;
    EXPECT_TRUE(o.contains(8.01 * out)) << degrees;
    EXPECT_TRUE(o.contains(12.49 * out)) << degrees;
    EXPECT_FALSE(o.contains(12.51 * out)) << degrees;
  }
}

TEST(Shape, IIsAnUprightBarOfTwofoldSymmetry) {
  const Shape shape = make_shape("I");
  for (double y = -13.0; y <= 13.0; y += 0.26) {
    for (double x = -4.0; x <= 4.0; x += 0.17) {
      EXPECT_EQ(shape.contains({x, y}), shape.contains({-x, -y})) << x << "," << y;
      // A bar: within 2.25 mm of the segment from (0, -10.25) to (0, 10.25).
      const double beyond = std::max(0.0, std::abs(y) - 10.25);
      EXPECT_EQ(shape.contains({x, y}), std::hypot(x, beyond) <= 2.25) << x << "," << y;
    }
  }
}

TEST(Shape, AIsOpenBelowItsBarAndPointsUp) {
  const Shape a = make_shape("A");
  EXPECT_TRUE(a.contains({0.0, 12.0}));
  EXPECT_TRUE(a.contains({0.0, -4.5}));
  EXPECT_FALSE(a.contains({0.0, 0.0}));
  EXPECT_FALSE(a.contains({0.0, -11.0}));
  EXPECT_TRUE(a.contains({-8.5, -10.25}));
  EXPECT_TRUE(a.contains({8.5, -10.25}));
  EXPECT_FALSE(a.contains({-8.5, 10.25}));
}

TEST(Shape, LowerCaseLettersAreTheirCapitals) {
  const Shape lower = make_shape("e");
  EXPECT_EQ(lower.label, "E");
  EXPECT_EQ(lower.strokes.size(), make_shape("E").strokes.size());
}

TEST(Shape, UnknownNamesListWhatThereIs) {
  for (const char* name : {"", "?", "AB", "Ring", "no_such_file.txt", "."}) {
    try {
      make_shape(name);
      FAIL() << name;
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), Fault::input);
      EXPECT_THAT(error.what(), testing::HasSubstr(std::string("'") + name + "'"));
      EXPECT_THAT(error.what(), testing::HasSubstr("A to Z, 0 to 9, ring, bar"));
    }
  }
}

TEST(Shape, OverlappingPolygonsCancelAndStrokesUnite) {
  const auto square = [](double half) {
    return std::vector<glm::dvec2>{{-half, -half}, {half, -half}, {half, half}, {-half, half}};
  };
  Shape shape{.label = "frame", .strokes = {}, .polygons = {square(3.0), square(2.0)}};
  EXPECT_FALSE(shape.contains({0.0, 0.0}));
  EXPECT_TRUE(shape.contains({2.5, 0.0}));
  EXPECT_FALSE(shape.contains({3.5, 0.0}));
  shape.strokes = {{.points_mm = {{0.0, 0.0}}, .width_mm = 1.0}};  // a disc
  EXPECT_TRUE(shape.contains({0.3, 0.3}));
  EXPECT_FALSE(shape.contains({0.5, 0.5}));
}

}  // namespace palpate::shape_test
