#pragma once

#include <cstddef>
#include <vector>

#include <glm/vec2.hpp>

#include "model/random.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// Displacements that stand for the distribution with equal weights: a mean over them approximates
/// the mean over the distribution. The points follow a sequence of low discrepancy (Roberts 2018:
/// multiples of powers of the generalised golden ratio), so that fewer suffice than of random ones.
/// One point at 0 where nothing is displaced.
std::vector<Pose> displacement_points(const DisplacementSd& sd, std::size_t count);

/// One displacement drawn from the distribution.
Pose random_displacement(const DisplacementSd& sd, Random& random);

/// T_object_robot of an object that has slipped: turned about its centroid, then moved, both in the
/// object frame: p' = R (p - g) + g + t.
/// @param centroid_mm g, in the object frame
Pose slipped(const Pose& T_object_robot, const Pose& slip, const glm::dvec2& centroid_mm);

/// The x below which a standard normal variable lies with this probability, within 1e-9.
/// @param probability above 0 and below 1
double normal_quantile(double probability);

}  // namespace palpate
