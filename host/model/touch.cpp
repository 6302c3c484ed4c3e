#include "palpate/touch.hpp"

#include <algorithm>
#include <cmath>

#include "model/bounding_box.hpp"

namespace palpate {

std::vector<glm::dvec2> digitacts_array() {
  constexpr double columns_mm[] = {-4.9, -3.0, -1.1, 1.1, 3.0, 4.9};
  std::vector<glm::dvec2> elements;
  elements.reserve(36);
  for (int row = 0; row < 6; ++row) {
    for (const double x : columns_mm) {
      elements.emplace_back(x, (row - 2.5) * 1.9);
    }
  }
  return elements;
}

std::vector<glm::dvec2> grid_array(int columns, int rows, double pitch_mm) {
  std::vector<glm::dvec2> elements;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      elements.emplace_back((column - (columns - 1) / 2.0) * pitch_mm,
                            (row - (rows - 1) / 2.0) * pitch_mm);
    }
  }
  return elements;
}

glm::dvec2 array_centre_mm(std::span<const glm::dvec2> elements_mm) {
  return elements_mm.empty() ? glm::dvec2(0.0) : bounding_box(elements_mm).middle();
}

double array_reach_mm(std::span<const glm::dvec2> elements_mm) {
  const glm::dvec2 centre_mm = array_centre_mm(elements_mm);
  double reach = 0.0;
  for (const glm::dvec2& element : elements_mm) {
    reach = std::max(reach, std::hypot(element.x - centre_mm.x, element.y - centre_mm.y));
  }
  return reach;
}

Touch Recording::touch(std::size_t i) const {
  const std::size_t e = elements();
  // An array that changes, or elements that die on the way, have a row per touch.
  const auto row = [&](const auto& values) {
    return std::span(values).subspan(values.size() == e ? 0 : i * e, e);
  };
  return {.T_robot_sensor = T_robot_sensor[i],
          .elements_mm = row(elements_mm),
          .pressure = std::span(pressure).subspan(i * e, e),
          .valid = valid.empty() ? std::span<const std::uint8_t>{} : row(valid)};
}

std::vector<Touch> Recording::touches(std::size_t begin, std::size_t end) const {
  std::vector<Touch> views;
  views.reserve(end - begin);
  for (std::size_t i = begin; i < end; ++i) {
    views.push_back(touch(i));
  }
  return views;
}

}  // namespace palpate
