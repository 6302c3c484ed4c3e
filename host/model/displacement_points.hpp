#pragma once

#include <cstddef>
#include <vector>

#include "palpate/displacement.hpp"
#include "palpate/pose.hpp"
#include "random.hpp"

namespace palpate {

/// Displacements that stand for the distribution with equal weights: a mean over them approximates
/// the mean over the distribution. The points follow a sequence of low discrepancy (Roberts 2018:
/// multiples of powers of the generalised golden ratio), so that fewer suffice than of random ones.
/// One point at 0 where nothing is displaced.
std::vector<Pose> displacement_points(const DisplacementSd& sd, std::size_t count);

/// One displacement drawn from the distribution.
Pose random_displacement(const DisplacementSd& sd, Random& random);

/// The x below which a standard normal variable lies with this probability, within 1e-9.
/// @param probability above 0 and below 1
double normal_quantile(double probability);

}  // namespace palpate
