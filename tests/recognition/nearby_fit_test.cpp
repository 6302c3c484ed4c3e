#include "nearby_fit.hpp"

#include <gtest/gtest.h>

#include "synthetic.hpp"
#include "touched_shape.hpp"

namespace palpate {
namespace {

TEST(NearbyFit, FindsThePoseWithinAStepOfTheParticlesGrid) {
  const OccupancyGrid map = map_of(on_letter_l, "L");
  const ContactModel contact{.prior = 0.2};
  const Pose truth{{1.3, -0.8}, 0.7};
  const Recording recording = touches_of(on_letter_l, truth, 8, 851);
  const std::vector<Touch> touches = all_touches(recording);
  const double at_truth = fit_of(touches, truth, map, contact, 0)->z;
  // What shares of a step, 0.25, 0.125 and 0.0625 mm, add up to.
  for (const glm::dvec2& off_mm : {glm::dvec2(0.375, 0.0), glm::dvec2(-0.4375, 0.25)}) {
    const Pose start{truth.translation_mm + off_mm, truth.theta_rad};
    const double at_start = fit_of(touches, start, map, contact, 0)->z;
    const double found = best_fit_near(touches, start, map, contact, 0)->z;
    EXPECT_GE(found, at_start);
    EXPECT_GT(found, at_truth - 0.05) << "from " << at_start;
  }
}

}  // namespace
}  // namespace palpate
