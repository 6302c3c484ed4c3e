#include "io/spatial_pose.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

namespace palpate {

namespace {

constexpr double rounding = 1e-2;  // three decimals of a log leave less

std::size_t axis_of(char letter) {
  return static_cast<std::size_t>(std::tolower(static_cast<unsigned char>(letter)) - 'x');
}

}  // namespace

SpatialPose operator*(const SpatialPose& a, const SpatialPose& b) {
  return {a.translation_mm + a.rotation * b.translation_mm, a.rotation * b.rotation};
}

bool are_axes(std::string_view axes) {
  const auto all_of = [&](std::string_view letters) {
    return axes.find_first_not_of(letters) == axes.npos;
  };
  return axes.size() == 3 && (all_of("xyz") || all_of("XYZ")) && axes[0] != axes[1] &&
         axes[1] != axes[2];
}

glm::dquat rotation_of_angles(std::string_view axes, std::span<const double> rad) {
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};
  for (std::size_t i = 0; i < axes.size(); ++i) {
    glm::dvec3 axis{0.0};
    axis[static_cast<int>(axis_of(axes[i]))] = 1.0;
    const glm::dquat turn = rotation_of_vector(rad[i] * axis);
    const bool is_fixed = std::islower(static_cast<unsigned char>(axes[i])) != 0;
    rotation = is_fixed ? turn * rotation : rotation * turn;
  }
  return rotation;
}

glm::dquat rotation_of_vector(const glm::dvec3& v) {
  const double angle = glm::length(v);
  return angle == 0.0 ? glm::dquat(1.0, 0.0, 0.0, 0.0) : glm::angleAxis(angle, v / angle);
}

std::optional<SpatialPose> pose_of_matrix(std::span<const double> numbers, bool by_columns) {
  const std::size_t rows = numbers.size() / 4;  // of four columns
  const auto at = [&](std::size_t row, std::size_t column) {
    return by_columns ? numbers[column * rows + row] : numbers[row * 4 + column];
  };
  glm::dmat3 r;
  SpatialPose pose;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      r[column][row] = at(static_cast<std::size_t>(row), static_cast<std::size_t>(column));
    }
    pose.translation_mm[row] = at(static_cast<std::size_t>(row), 3);
  }
  bool is_one = std::abs(glm::determinant(r) - 1.0) <= rounding;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      is_one = is_one && std::abs(glm::dot(r[i], r[j]) - (i == j ? 1.0 : 0.0)) <= rounding;
    }
  }
  for (std::size_t column = 0; column < 4 && rows == 4; ++column) {
    is_one = is_one && at(3, column) == (column == 3 ? 1.0 : 0.0);
  }
  pose.rotation = glm::normalize(glm::quat_cast(r));
  return is_one ? std::optional(pose) : std::nullopt;
}

}  // namespace palpate
