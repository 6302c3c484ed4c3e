#include "bounded_case.hpp"

#include <gtest/gtest.h>

namespace palpate {

BoundedOptions few_bins() {
  BoundedOptions options;
  options.lattice = {.x_mm = {-5.0, 5.0, 9}, .y_mm = {-5.0, 5.0, 8}, .theta_rad = {0, two_pi, 7}};
  return options;
}

Certified expect_certificate(HardCase& hard, const std::vector<Hypothesis>& objects,
                             const BoundedOptions& options, const Recording& recording,
                             double nats) {
  BoundedPosterior posterior(objects, options);
  Certified seen;
  for (std::size_t n = 0; n <= recording.size(); ++n) {
    SCOPED_TRACE(::testing::Message() << n << " touches");
    if (n > 0) {
      posterior.update(recording.touch(n - 1));
    }
    seen = expect_certified(posterior, objects, options,
                            reference_posterior(objects, options, recording.touches(0, n)), nats);
    EXPECT_TRUE(all_finite(seen.estimate.identity));
    const RefinedPose refined = posterior.refine(seen.estimate.mode);
    EXPECT_TRUE(all_finite(refined.covariance));
    EXPECT_TRUE(all_finite(std::vector{refined.T_object_robot.translation_mm.x,
                                       refined.T_object_robot.translation_mm.y,
                                       refined.T_object_robot.theta_rad}));
    const double rounded = 2.0 * nats + 1e-14;
    hard.expect("identity", seen.identity_error, options.tolerance + rounded);
    hard.expect("total variation", seen.total_variation, options.tolerance + rounded);
    if (seen.estimate.certificate) {
      hard.expect("certificate", seen.estimate.certificate->dropped_mass,
                  options.tolerance + rounded);
    }
  }
  return seen;
}

}  // namespace palpate
