#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace palpate {

/// What one touch is expected to tell, in nats: the mutual information between its readings and the
/// unknown, given the touches so far. By the chain rule, information about (object, pose) is that
/// about the object plus that about the pose once the object is known.
/// Estimates, none of them below 0.
struct TouchGain {
  /// Standard errors of the estimates, from the spread over simulated readings; what too few
  /// samples cannot show is not in them.
  struct StandardError {
    double identity = 0.0;
    double pose = 0.0;
    double both = 0.0;
  };

  double identity = 0.0;  ///< about which object it is
  double pose = 0.0;      ///< about the pose, given the object
  StandardError standard_error = {};
  /// About object and pose together.
  double both() const { return identity + pose; }
};

/// How expected_gain() of PoseHistogram and BoundedPosterior estimates.
struct PlanOptions {
  /// Objects and poses that stand for the belief. No gain exceeds the log of their number. The
  /// time grows with the square of the number.
  std::size_t samples = 96;
  std::uint64_t seed = 0;  ///< of the samples and the simulated readings
  /// [hypothesis] objects of equal numbers count as one: maps of one label, which no touch needs to
  /// tell apart. Empty: every hypothesis is an object of its own.
  std::vector<std::size_t> label_of = {};
};

}  // namespace palpate
