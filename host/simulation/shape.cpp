#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "model/number_text.hpp"
#include "model/printable.hpp"
#include "palpate/error.hpp"
#include "palpate/simulation.hpp"
#include "simulation/glyphs.hpp"
#include "simulation/spans.hpp"

namespace palpate {

namespace {

[[noreturn]] void refuse(const std::filesystem::path& path, int line, const std::string& why) {
  throw Error(Fault::input, fmt::format("{}:{}: {}", path.string(), line, why));
}

/// True where some triangle of the first vertex and an edge has an area. Otherwise all edges lie on
/// rays from the first vertex, and the polygon encloses nothing.
bool encloses_area(const std::vector<glm::dvec2>& polygon) {
  for (std::size_t i = 2; i < polygon.size(); ++i) {
    const glm::dvec2 a = polygon[i - 1] - polygon[0];
    const glm::dvec2 b = polygon[i] - polygon[0];
    if (a.x * b.y != a.y * b.x) {
      return true;
    }
  }
  return false;
}

/// The polygons of a text file in mm, in the format that make_shape() describes.
/// @throws Error naming the file and line
std::vector<std::vector<glm::dvec2>> read_polygons(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) {
    throw Error(
        Fault::input,
        fmt::format("{}: cannot be opened; check the path and its permissions", path.string()));
  }
  std::vector<std::vector<glm::dvec2>> polygons;
  std::vector<glm::dvec2> polygon;
  int first_line = 0;
  const auto finish_polygon = [&] {
    if (polygon.empty()) {
      return;
    }
    if (polygon.size() < 3) {
      refuse(path, first_line,
             fmt::format("polygon of {} vertices: give at least 3", polygon.size()));
    }
    if (!encloses_area(polygon)) {
      refuse(path, first_line,
             fmt::format("polygon of {} vertices on one line: give it an area", polygon.size()));
    }
    polygons.push_back(std::move(polygon));
    polygon.clear();
  };

  std::string text;
  for (int line = 1; std::getline(file, text); ++line) {
    constexpr const char* blanks = " \t\r";
    if (text.find_first_not_of(blanks) == std::string::npos) {
      finish_polygon();
      continue;
    }
    text.resize(std::min(text.find('#'), text.size()));
    if (text.find_first_not_of(blanks) == std::string::npos) {
      continue;
    }
    const auto vertex = two_numbers_of(text);
    if (!vertex) {
      refuse(path, line,
             fmt::format("'{:.40}': write a vertex as two finite numbers, x y, in mm", text));
    }
    if (polygon.empty()) {
      first_line = line;
    }
    polygon.emplace_back((*vertex)[0], (*vertex)[1]);
  }
  if (file.bad()) {
    throw Error(Fault::input, fmt::format("{}: cannot be read; copy it again", path.string()));
  }
  finish_polygon();
  if (polygons.empty()) {
    throw Error(Fault::input, fmt::format("{}: holds no polygon; write one vertex 'x y' in mm per "
                                          "line",
                                          path.string()));
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
    throw Error(Fault::input, fmt::format("shape '{}': not a file and no shape of that name; give "
                                          "A to Z, 0 to 9, ring, bar or a polygon file",
                                          name_or_file));
  }
  return {.label = printable(path.stem().string()), .strokes = {}, .polygons = read_polygons(path)};
}

}  // namespace palpate
