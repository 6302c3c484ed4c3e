#include "polygon_file.hpp"

#include <algorithm>
#include <fstream>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "number_text.hpp"
#include "palpate/error.hpp"

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

}  // namespace

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

}  // namespace palpate
