#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <glm/trigonometric.hpp>

#include "model/bounding_box.hpp"
#include "model/number_text.hpp"
#include "model/printable.hpp"
#include "model/refuse.hpp"
#include "palpate/simulation.hpp"
#include "simulation/spans.hpp"

namespace palpate {

namespace {

constexpr double width_mm = 4.5;
/// Half the height between the centre lines of the top and the bottom stroke.
constexpr double h = (25.0 - width_mm) / 2.0;

/// A piece of a centre line: a point, or with radii an elliptical arc around it. In mm.
struct Piece {
  double x;
  double y;
  double rx = 0.0;
  double ry = 0.0;
  double from_deg = 0.0;
  double to_deg = 0.0;
};
using CentreLine = std::vector<Piece>;

// Bold capitals as in a child's alphabet. No glyph is a rotated copy of another: W has slanted
// sides where M has upright ones, 9 has a straight stem where 6 is curved, 0 is narrower than O, 1
// has a flag and a base. Absolute x does not matter, as glyph_strokes() centres each glyph.
// clang-format off
const std::map<char, std::vector<CentreLine>> centre_lines = {
    {'A', {{{-8.5, -h}, {0, h}, {8.5, -h}}, {{-6, -4.5}, {6, -4.5}}}},
    {'B', {{{-6, 0}, {-6, h}, {0.5, h}, {0.5, 5.125, 5.125, 5.125, 90, -90}, {-6, 0}},
           {{-6, 0}, {-6, -h}, {1.5, -h}, {1.5, -5.125, 5.125, 5.125, -90, 90}}}},
    {'C', {{{0, 0, h, h, 48, 312}}}},
    {'D', {{{-7.5, -h}, {-7.5, h}, {-2, h}, {-2, 0, h, h, 90, -90}, {-7.5, -h}}}},
    {'E', {{{6.5, h}, {-6.5, h}, {-6.5, -h}, {6.5, -h}}, {{-6.5, 0}, {4.5, 0}}}},
    {'F', {{{6.5, h}, {-6.5, h}, {-6.5, -h}}, {{-6.5, 0}, {4.5, 0}}}},
    {'G', {{{0, 0, h, h, 48, 360}, {3, 0}}}},
    {'H', {{{-7, -h}, {-7, h}}, {{7, -h}, {7, h}}, {{-7, 0}, {7, 0}}}},
    {'I', {{{0, -h}, {0, h}}}},
    {'J', {{{5, h}, {5, -4.5}, {-1, -4.5, 6, 5.75, 0, -165}}}},
    {'K', {{{-6, -h}, {-6, h}}, {{7, h}, {-6, -1.5}}, {{-1.5, 2.57}, {7.5, -h}}}},
    {'L', {{{-6, h}, {-6, -h}, {6, -h}}}},
    {'M', {{{-9, -h}, {-9, h}, {0, -4}, {9, h}, {9, -h}}}},
    {'N', {{{-7.5, -h}, {-7.5, h}, {7.5, -h}, {7.5, h}}}},
    {'O', {{{0, 0, h, h, 0, 360}}}},
    {'P', {{{-6, -h}, {-6, h}, {0.5, h}, {0.5, 4.75, 5.5, 5.5, 90, -90}, {-6, -0.75}}}},
    {'Q', {{{0, 0, h, h, 0, 360}}, {{3, -3}, {10, -10}}}},
    {'R', {{{-6, -h}, {-6, h}, {0.5, h}, {0.5, 4.75, 5.5, 5.5, 90, -90}, {-6, -0.75}},
           {{0, -0.75}, {7, -h}}}},
    {'S', {{{0, 5.125, 6.5, 5.125, 25, 270}, {0, -5.125, 6.5, 5.125, 90, -155}}}},
    {'T', {{{-8.5, h}, {8.5, h}}, {{0, h}, {0, -h}}}},
    {'U', {{{-7.5, h}, {0, -2.75, 7.5, 7.5, 180, 360}, {7.5, h}}}},
    {'V', {{{-8.5, h}, {0, -h}, {8.5, h}}}},
    {'W', {{{-h, h}, {-5.5, -h}, {0, 5}, {5.5, -h}, {h, h}}}},
    {'X', {{{-8, -h}, {8, h}}, {{-8, h}, {8, -h}}}},
    {'Y', {{{-8.5, h}, {0, -0.5}, {8.5, h}}, {{0, -0.5}, {0, -h}}}},
    {'Z', {{{-7, h}, {7, h}, {-7, -h}, {7, -h}}}},
    {'0', {{{0, 0, 6.75, h, 0, 360}}}},
    {'1', {{{-5, 6}, {0, h}, {0, -h}}, {{-5, -h}, {5, -h}}}},
    {'2', {{{0, 4.25, 6, 6, 165, -40}, {-6.5, -h}, {6.5, -h}}}},
    {'3', {{{0, 5.25, 5.5, 5, 155, -90}, {0, -5, 6.5, 5.25, 90, -155}}}},
    {'4', {{{3, -h}, {3, h}, {-7.5, -4.5}, {7.5, -4.5}}}},
    {'5', {{{5.5, h}, {-4.5, h}, {-0.25, -3.9, 6.35, 6.35, 140, -150}}}},
    {'6', {{{0, -4, 6.25, 6.25, 0, 360}}, {{4.75, -4, 11, 14.25, 180, 90}}}},
    {'7', {{{-7, h}, {7, h}, {-2.5, -h}}}},
    {'8', {{{0, 5.25, 5.4, 5, 0, 360}}, {{0, -5, 6.6, 5.25, 0, 360}}}},
    {'9', {{{0, 4, 6.25, 6.25, 0, 360}}, {{6.25, 4}, {6.25, -h}}}},
};
// clang-format on

/// Moves the middle of the bounding box to the origin.
void centre(std::vector<Shape::Stroke>& strokes) {
  BoundingBox box;
  for (const Shape::Stroke& stroke : strokes) {
    for (const glm::dvec2& p : stroke.points_mm) {
      box.take_in(p);
    }
  }
  for (Shape::Stroke& stroke : strokes) {
    for (glm::dvec2& p : stroke.points_mm) {
      p -= box.middle();
    }
  }
}

/// Returns an elliptical arc as a polyline, counter-clockwise where to_deg > from_deg.
std::vector<glm::dvec2> arc(const glm::dvec2& centre_mm, const glm::dvec2& radii_mm,
                            double from_deg, double to_deg) {
  // Chords of 2 degrees lie within 0.002 mm of the largest glyph's circle.
  const int chords = static_cast<int>(std::ceil(std::abs(to_deg - from_deg) / 2.0));
  std::vector<glm::dvec2> points;
  for (int k = 0; k <= chords; ++k) {
    const double a = glm::radians(from_deg + (to_deg - from_deg) * k / std::max(chords, 1));
    points.push_back(centre_mm + radii_mm * glm::dvec2(std::cos(a), std::sin(a)));
  }
  return points;
}

/// Returns the strokes of 'A'..'Z' or '0'..'9', 25 mm high and 4.5 mm wide, with the glyph's
/// bounding box centred on the origin; none for any other character.
std::vector<Shape::Stroke> glyph_strokes(char character) {
  const auto glyph = centre_lines.find(character);
  if (glyph == centre_lines.end()) {
    return {};
  }
  std::vector<Shape::Stroke> strokes;
  for (const CentreLine& line : glyph->second) {
    Shape::Stroke& stroke =
        strokes.emplace_back(Shape::Stroke{.points_mm = {}, .width_mm = width_mm});
    for (const Piece& piece : line) {
      const std::vector<glm::dvec2> points =
          arc({piece.x, piece.y}, {piece.rx, piece.ry}, piece.from_deg, piece.to_deg);
      stroke.points_mm.insert(stroke.points_mm.end(), points.begin(), points.end());
    }
  }
  centre(strokes);
  return strokes;
}

/// The polygons of a text file in mm, in the format that make_shape() describes.
/// @throws Error naming the file and line
std::vector<std::vector<glm::dvec2>> read_polygons(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) {
    refuse(path, "cannot be opened; check the path and its permissions");
  }
  const auto place = [&](int line) { return fmt::format("{}:{}", path.string(), line); };
  std::vector<std::vector<glm::dvec2>> polygons;
  std::vector<glm::dvec2> polygon;
  int first_line = 0;
  const auto finish_polygon = [&] {
    if (polygon.empty()) {
      return;
    }
    if (polygon.size() < 3 || !encloses_area(polygon)) {
      refuse(place(first_line), "polygon of {} vertices{}", polygon.size(),
             polygon.size() < 3 ? ": give at least 3" : " on one line: give it an area");
    }
    polygons.push_back(std::exchange(polygon, {}));
  };

  const auto is_blank = [](std::string_view part) {
    return part.find_first_not_of(" \t\r") == part.npos;
  };
  std::string text;
  for (int line = 1; std::getline(file, text); ++line) {
    const std::string row = text.substr(0, text.find('#'));
    if (is_blank(text)) {
      finish_polygon();
    } else if (!is_blank(row)) {
      const auto vertex = two_numbers_of(row);
      if (!vertex) {
        refuse(place(line), "'{:.40}': write a vertex as two finite numbers, x y, in mm", row);
      }
      first_line = polygon.empty() ? line : first_line;
      polygon.emplace_back((*vertex)[0], (*vertex)[1]);
    }
  }
  if (file.bad()) {
    refuse(path, "cannot be read; copy it again");
  }
  finish_polygon();
  if (polygons.empty()) {
    refuse(path, "holds no polygon; write one vertex 'x y' in mm per line");
  }
  return polygons;
}

}  // namespace

bool Shape::contains(const glm::dvec2& p_object_mm) const {
  const std::vector<Span> on_line = spans(*this, p_object_mm.y);
  return std::any_of(on_line.begin(), on_line.end(), [x = p_object_mm.x](const Span& span) {
    return span.begin <= x && x <= span.end;
  });
}

std::optional<Shape> built_in_shape(const std::string& name) {
  if (name.size() == 1) {
    char character = name[0];
    if (character >= 'a' && character <= 'z') {
      character = static_cast<char>(character - 'a' + 'A');
    }
    if (std::vector<Shape::Stroke> strokes = glyph_strokes(character); !strokes.empty()) {
      return Shape{.label = {character}, .strokes = std::move(strokes), .polygons = {}};
    }
  }
  if (name == "ring") {
    return Shape{
        .label = "ring",
        .strokes = {{.points_mm = arc({0.0, 0.0}, {7.5, 7.5}, 0.0, 360.0), .width_mm = 3.0}},
        .polygons = {}};
  }
  if (name == "bar") {
    return Shape{.label = "bar",
                 .strokes = {},
                 .polygons = {{{-10.0, -4.0}, {10.0, -4.0}, {10.0, 4.0}, {-10.0, 4.0}}}};
  }
  return {};
}

Shape make_shape(const std::string& name_or_file) {
  if (std::optional<Shape> shape = built_in_shape(name_or_file)) {
    return *std::move(shape);
  }
  const std::filesystem::path path(name_or_file);
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored) || std::filesystem::is_directory(path, ignored)) {
    refuse(
        fmt::format("shape '{}'", name_or_file),
        "not a file and no shape of that name; give A to Z, 0 to 9, ring, bar or a polygon file");
  }
  return {.label = printable(path.stem().string()), .strokes = {}, .polygons = read_polygons(path)};
}

}  // namespace palpate
