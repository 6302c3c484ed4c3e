#pragma once

#include <cstddef>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/displacement.hpp"
#include "palpate/lattice.hpp"
#include "shaders/interface.h"

namespace palpate {

/// Bins to either side that a Gaussian of this standard deviation reaches, cut off at 4 of them. 0
/// for an axis of one bin, which is not blurred.
int blur_steps(double sd, const Axis& axis);

/// The weights of a Gaussian by distance in bins, the first is 1; `steps` + 1 numbers.
std::vector<float> blur_weights(double sd, const Axis& axis, int steps);

/// For every bin of the axis 1 over the sum of the weights whose bins lie inside.
std::vector<float> blur_norms(const std::vector<float>& weights, const Axis& axis);

/// Where an uncertain touch takes the likelihood of a bin from as theta grows by k steps, |k| <=
/// `steps`: t + (R(theta) - R(theta + alpha)) r, [theta, k].
/// @param sensor_from_pivot_mm r: the sensor's origin relative to the pivot, in the robot frame
/// @param reuse memory for the result
std::vector<shaders::Turn> touch_turns(const PoseLattice& lattice,
                                       const glm::dvec2& sensor_from_pivot_mm, int steps,
                                       std::vector<shaders::Turn> reuse = {});

/// Where a slip takes the belief of a bin from as theta grows by k steps: g + R(alpha) (t - g),
/// [object, k].
/// @param centroids_mm g of every object, in its frame
std::vector<shaders::Turn> slip_turns(const PoseLattice& lattice,
                                      const std::vector<glm::dvec2>& centroids_mm, int steps);

}  // namespace palpate
