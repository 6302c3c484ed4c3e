#pragma once

#include <cstddef>

#include "palpate/api.hpp"
#include "palpate/contact.hpp"

namespace palpate {

/// Smallest prior of a map, and smallest 1 - prior: beyond these, increments in float32 miss the
/// tolerance of MapBuilder::build().
inline constexpr double least_prior = 1e-6;

/// Smallest peak: a reading with a smaller one says nothing.
inline constexpr double least_peak = 1e-6;

/// The inverse sensor model of Eq. 4-6: how much one element's reading changes the log odds of the
/// cells around it. The printed equations contradict each other; the consistent reading is
///   G'(d) = peak * exp(-d^2 / (2 spread^2)),
///   p = m + (1 - m) G' (In Contact), m - m G' (No Contact), m (Unknown),
///   increment = log(p / (1 - p)) - log(m / (1 - m)).
struct PALPATE_API InverseSensorModel {
  double spread_mm = 0.5;  ///< half the standard deviation of the sensor's point spread
  double peak = 0.9;       ///< at most 0.9999: at 1 a single reading would make a cell certain
  double prior = 0.2;      ///< m

  /// Throws Error unless least_length_mm <= spread_mm <= most_length_mm (see OccupancyGrid),
  /// least_peak <= peak <= 0.9999 and least_prior <= prior <= 1 - least_prior.
  void validate() const;
  /// Log-odds increment of a cell whose centre is this far from the element's, in nats (Eq. 5).
  double increment(Reading reading, double distance_mm) const;
  /// Distance beyond which this many increments together stay below `tolerance` nats, in mm.
  double support_radius_mm(std::size_t readings, double tolerance) const;
};

}  // namespace palpate
