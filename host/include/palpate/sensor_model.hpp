#pragma once

#include <cstddef>

#include "palpate/contact.hpp"

namespace palpate {

/// The smallest prior of a map, and its distance from 1: beyond it, what a reading says 10 spreads
/// away would still outweigh the prior.
inline constexpr double least_prior = 1e-6;

/// The smallest peak: a reading of less says nothing.
inline constexpr double least_peak = 1e-6;

/// The inverse sensor model of Eq. 4-6: how much one element's reading changes the log odds of the
/// cells around it. The printed equations contradict each other; the consistent reading is
///   G'(d) = peak * exp(-d^2 / (2 spread^2)),
///   p = m + (1 - m) G' (In Contact), m - m G' (No Contact), m (Unknown),
///   increment = log(p / (1 - p)) - log(m / (1 - m)).
struct InverseSensorModel {
  double spread_mm = 0.5;  ///< half the standard deviation of the sensor's point spread
  double peak = 0.9;       ///< at most 0.9999: at 1 a single reading would make a cell certain
  double prior = 0.2;      ///< m

  /// Throws Error unless the spread lies within the bounds of lengths that occupancy_grid.hpp
  /// gives, least_peak <= peak <= 0.9999 and least_prior <= prior <= 1 - least_prior.
  void validate() const;
  /// Log-odds increment of a cell at this distance from the element's centre, in nats.
  double increment(Reading reading, double distance_mm) const;
  /// Distance beyond which `readings` increments together stay below `tolerance` nats.
  double support_radius_mm(std::size_t readings, double tolerance) const;
};

/// The forward model of Eq. 7 for one element: gamma m + (1 - gamma) p(reading | occupancy).
/// Any other likelihood per reading class and interpolated log odds takes this place, here and in
/// shaders/contact_likelihood.glsl.
struct ContactLikelihood {
  double gamma = 0.1;  ///< rate at which the classifier answers at random, in [0, 1)
  double prior = 0.2;  ///< m

  void validate() const;
  /// Log-likelihood in nats. With gamma = 0 it is that of the logistic function, without a floor.
  double log_likelihood(Reading reading, double log_odds) const;
};

}  // namespace palpate
