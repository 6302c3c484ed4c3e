#include "recognition/nearby_fit.hpp"

#include <gtest/gtest.h>

#include "support/synthetic.hpp"
#include "support/touched_shape.hpp"

namespace palpate::nearby_fit_test {

TEST(NearbyFit, IsAsGoodAsThatOfTheTruePoseHalfAStepAway) {
  const OccupancyGrid map = map_of(on_letter_l, "L");
  const ContactModel contact{.prior = 0.2};
  const Pose truth{{1.3, -0.8}, 0.7};
  const Recording recording = touches_of(on_letter_l, truth, 20, 856);
  const std::vector<Touch> touches = all_touches(recording);
  const double at_truth = fit_of(touches, truth, map, contact, 0)->z;
  for (const glm::dvec2& off_mm : {glm::dvec2(0.375, 0.0), {-0.4375, 0.25}, {0.4, 0.4}}) {
    const Pose start{truth.translation_mm + off_mm, truth.theta_rad + 0.05};
    EXPECT_LT(fit_of(touches, start, map, contact, 0)->z, at_truth - 1.0);
    // The best pose of these touches fits a little better than the true one.
    EXPECT_GT(best_fit_near(evidence_of(touches, contact), start, map, contact, 0)->z, at_truth);
  }
}

}  // namespace palpate::nearby_fit_test
