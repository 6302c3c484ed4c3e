#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "glyphs.hpp"
#include "palpate/error.hpp"
#include "palpate/simulation.hpp"
#include "polygon_file.hpp"
#include "printable.hpp"
#include "spans.hpp"

namespace palpate {

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
