#include <algorithm>
#include <bitset>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <glm/common.hpp>

#include "palpate/pose.hpp"
#include "palpate/simulation.hpp"
#include "support/errors.hpp"
#include "support/host_locale.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::shape_test {

constexpr double half_box_mm = 12.5;

/// Every shape that has a name.
std::vector<Shape> shapes() {
  std::vector<Shape> all{make_shape("ring"), make_shape("bar")};
  for (const char c : std::string("ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789")) {
    all.push_back(make_shape({c}));
    EXPECT_EQ(all.back().label, std::string{c});
  }
  return all;
}

// A 0.8 mm raster over 40 x 40 mm.
constexpr int side = 50;
constexpr double pitch_mm = 0.8;

glm::dvec2 cell_centre_mm(int cell) {
  return pitch_mm * glm::dvec2(cell % side + 0.5 - side / 2.0, cell / side + 0.5 - side / 2.0);
}

using Raster = std::bitset<side * side>;

/// Whether the centre of each cell lies on the shape turned about the origin.
Raster rasterize(const Shape& shape, double theta_rad = 0.0) {
  Raster on;
  for (int cell = 0; cell < side * side; ++cell) {
    on[cell] = shape.contains(rotate(-theta_rad, cell_centre_mm(cell)));
  }
  return on;
}

TEST(Shape, EveryShapeIsCentredInTheBoxAndGlyphsFillItsHeight) {
  for (const Shape& shape : shapes()) {
    SCOPED_TRACE(shape.label);
    glm::dvec2 lower{0.0};
    glm::dvec2 upper{0.0};
    const auto include = [&](std::span<const glm::dvec2> points, double radius_mm) {
      for (const glm::dvec2& p : points) {
        lower = glm::min(lower, p - radius_mm);
        upper = glm::max(upper, p + radius_mm);
      }
    };
    for (const Shape::Stroke& stroke : shape.strokes) {
      include(stroke.points_mm, stroke.width_mm / 2.0);
    }
    for (const std::vector<glm::dvec2>& polygon : shape.polygons) {
      include(polygon, 0.0);
    }
    // 1e-9: rounding only.
    EXPECT_NEAR(lower.x, -upper.x, 1e-9);
    EXPECT_NEAR(lower.y, -upper.y, 1e-9);
    EXPECT_LE(std::max(upper.x, upper.y), half_box_mm + 1e-9);
    if (shape.label.size() == 1) {
      // An arc's chords may pass by its highest point, by less than 0.002 mm.
      EXPECT_NEAR(upper.y, half_box_mm, 0.002);
    }
  }
}

TEST(Shape, NoTwoShapesAreAlikeInAnyRotation) {
  const std::vector<Shape> all = shapes();
  std::vector<Raster> rasters;
  for (const Shape& shape : all) {
    rasters.push_back(rasterize(shape));
  }
  for (int degrees = 0; degrees < 360; degrees += 20) {
    for (std::size_t b = 1; b < all.size(); ++b) {
      const Raster other = rasterize(all[b], degrees * std::numbers::pi / 180.0);
      for (std::size_t a = 0; a < b; ++a) {
        // Seven elements of the array. The closest are A and V upside down, with 36 mm^2.
        EXPECT_GT((rasters[a] ^ other).count() * pitch_mm * pitch_mm, 25.0)
            << all[a].label << " and " << all[b].label << " at " << degrees << " degrees";
      }
    }
  }
}

TEST(Shape, OIsARingAndIAnUprightBar) {
  const Shape o = make_shape("O");
  for (int degrees = 0; degrees < 360; ++degrees) {
    const glm::dvec2 out = rotate(degrees * std::numbers::pi / 180.0, {1.0, 0.0});
    // Centre line at 10.25 mm, 4.5 mm wide; 0.01 mm for the polyline's chords.
    EXPECT_FALSE(o.contains(7.99 * out) || o.contains(12.51 * out)) << degrees;
    EXPECT_TRUE(o.contains(8.01 * out) && o.contains(12.49 * out)) << degrees;
  }
  const Shape i = make_shape("I");
  for (double y = -13.0; y <= 13.0; y += 0.26) {
    for (double x = -4.0; x <= 4.0; x += 0.17) {
      // Within 2.25 mm of the segment from (0, -10.25) to (0, 10.25).
      const double beyond = std::max(0.0, std::abs(y) - 10.25);
      EXPECT_EQ(i.contains({x, y}), std::hypot(x, beyond) <= 2.25) << x << "," << y;
    }
  }
}

TEST(Shape, AIsOpenBelowItsBarAndPointsUp) {
  const Shape a = make_shape("A");
  for (const glm::dvec2& on : {glm::dvec2(0.0, 12.0), {0.0, -4.5}, {-8.5, -10.25}, {8.5, -10.25}}) {
    EXPECT_TRUE(a.contains(on)) << on.x << "," << on.y;
  }
  for (const glm::dvec2& off : {glm::dvec2(0.0, 0.0), {0.0, -11.0}, {-8.5, 10.25}}) {
    EXPECT_FALSE(a.contains(off)) << off.x << "," << off.y;
  }
}

TEST(Shape, UnknownNamesListWhatThereIs) {
  for (const char* name : {"", "?", "AB", "Ring", "no_such_file.txt", "."}) {
    const std::string quoted = std::string("'") + name + "'";
    expect_named(input_error([&] { make_shape(name); }),
                 {quoted.c_str(), "A to Z, 0 to 9, ring, bar"});
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

class PolygonFile : public testing::Test {
 protected:
  Shape read(const std::string& text) const {
    put_bytes(path_, text);
    const HostLocale locale;  // a program's own reads no number otherwise
    return make_shape(path_.string());
  }
  void expect_refused(const std::string& text, const std::string& line, const std::string& why) {
    const std::string refusal = input_error([&] { read(text); });
    EXPECT_TRUE(refusal.starts_with(path_.string() + ":" + line)) << refusal;
    expect_named(refusal, {why.c_str()});
  }

  ScratchFolder folder_;
  std::filesystem::path path_ = folder_ / "square.txt";
};

TEST_F(PolygonFile, HoldsPolygonsCommentsAndBlankLines) {
  const Shape shape = read(
      "# a square with a hole\r\n"
      "\n"
      "-5 -5\n"
      "5 -5   # right\n"
      "# a comment does not end a polygon\n"
      "+5 5e0\n"
      "\t-5 5\r\n"
      "  \n"
      "\n"
      "-1 -1\n"
      "1 -1\n"
      "0 1");
  EXPECT_EQ(shape.label, path_.stem().string());
  ASSERT_EQ(shape.polygons.size(), 2U);
  EXPECT_EQ(shape.polygons[0].size(), 4U);
  EXPECT_EQ(shape.polygons[1].size(), 3U);
  EXPECT_EQ(shape.polygons[0][2], glm::dvec2(5.0, 5.0));
  EXPECT_TRUE(shape.contains({3.0, 3.0}));
  EXPECT_FALSE(shape.contains({0.0, 0.0}));
}

TEST_F(PolygonFile, RefusesWhatIsNotAVertexOrEnclosesNothingNamingTheLine) {
  for (const char* bad :
       {"nan 1", "1 nan", "inf 1", "1e999 1", "1", "1 2 3", "1,2", "1 2mm", "x y"}) {
    expect_refused(std::string("0 0\n1 0\n") + bad + "\n", "3:", bad);
  }
  expect_refused("# none\n0 0\n1 0\n", "2:", "at least 3");
  expect_refused("0 0\n1 0\n0 1\n\n4 4\n\n0 0\n1 0\n0 1\n", "5:", "at least 3");
  expect_refused("0 0\n1 1\n2 2\n3 3\n", "1:", "on one line");
  expect_refused("", "", "no polygon");
  expect_refused("# nothing\n\n", "", "no polygon");
}

}  // namespace palpate::shape_test
