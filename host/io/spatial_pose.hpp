#pragma once

#include <optional>
#include <span>
#include <string_view>

#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>

namespace palpate {

/// A pose in space.
struct SpatialPose {
  glm::dvec3 translation_mm{0.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};  ///< of length 1; w, x, y, z
};

/// The pose `b`, given in the frame of `a`, in the frame in which `a` is.
SpatialPose operator*(const SpatialPose& a, const SpatialPose& b);

/// True for three axes of x, y and z in lower case (fixed) or in upper case (moving), none of which
/// follows itself.
bool are_axes(std::string_view axes);

/// Turns by the angles about the axes one after another, as SciPy's Rotation.from_euler(): lower
/// case, about fixed axes; upper case, about those that the turns before have moved.
/// @param axes see are_axes()
/// @param rad three angles
glm::dquat rotation_of_angles(std::string_view axes, std::span<const double> rad);

/// The rotation about a vector, by its length in rad.
glm::dquat rotation_of_vector(const glm::dvec3& v);

/// The pose that 12 or 16 numbers of a homogeneous matrix tell, [R t] or [R t; 0 1], its position
/// in the unit of the numbers; none where it is no rotation.
/// @param by_columns how the matrix is written
std::optional<SpatialPose> pose_of_matrix(std::span<const double> numbers, bool by_columns);

}  // namespace palpate
