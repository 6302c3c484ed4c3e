#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// An object that the unknown may turn out to be.
struct Hypothesis {
  OccupancyGrid map;
  double weight = 1.0;  ///< prior weight, relative to the other objects'
};

/// The bin of the largest posterior probability (Eq. 15-16).
struct Mode {
  int object = 0;        ///< index into the hypotheses
  std::int64_t bin = 0;  ///< index into the lattice
  Pose T_object_robot;
  double log_likelihood = 0.0;  ///< of all touches, without prior weights, in nats
};

/// What the belief says about the unknown object, after any number of touches.
struct Estimate {
  std::vector<double> identity;  ///< probability of every hypothesis, Eq. 14; with `none` sums to 1
  double none = 0.0;             ///< probability of "none of these", where that was asked for
  Mode mode;
  /// Even the best bin, or the best particle of each touch, explains the touches worse than a map
  /// of nothing but the prior does, by a factor below exp(-700), which is 0 in float64: the object,
  /// its pose or the sensor model cannot be what the hypotheses say. `identity` and `mode` still
  /// name the least impossible.
  bool contradicted = false;
};

/// A pose between the bins, with its uncertainty.
struct RefinedPose {
  Pose T_object_robot;
  /// Of (x_mm, y_mm, theta_rad) of T_object_robot, row by row, in mm^2, mm rad and rad^2.
  std::array<double, 9> covariance{};
};

}  // namespace palpate
