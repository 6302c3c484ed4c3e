#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "palpate/map_builder.hpp"
#include "support/synthetic.hpp"

namespace palpate::prior_test {

/// One touch of a 20 x 20 mm array of 0.5 mm pitch; a disc about its centre is in contact.
Recording touch_of_disc(double radius_mm) {
  Recording recording;
  recording.T_robot_sensor.resize(1);
  for (int j = -20; j <= 20; ++j) {
    for (int i = -20; i <= 20; ++i) {
      recording.elements_mm.emplace_back(0.5 * i, 0.5 * j);
      recording.pressure.push_back(std::hypot(0.5 * i, 0.5 * j) < radius_mm ? 10.0 : 0.0);
    }
  }
  return recording;
}

/// The fraction of the modelled area that lies nearest to elements in contact. The evidence of the
/// outermost rows, 2.5 elements' 2 * 0.9 exp(-d^2 / (2 * 0.5^2)), fades to 1e-3 at d = 2 mm.
double fraction(const Recording& recording) {
  constexpr double edge_mm = 20.0 + 2.0 * 2.0;
  const auto in_contact = std::count(recording.pressure.begin(), recording.pressure.end(), 10.0);
  return 0.25 * static_cast<double>(in_contact) / (edge_mm * edge_mm);
}

double estimate(std::vector<Recording> recordings) {
  Device device = Device::open();
  std::vector<ObjectTouches> touches;
  for (const Recording& recording : recordings) {
    touches.push_back({"disc", all_touches(recording)});
  }
  // No cell of 0.2 mm lies halfway between two elements, where contact and no contact cancel out.
  return estimate_prior(device, touches, {.cell_mm = 0.2});
}

TEST(EstimatePrior, IsTheObjectsAreaOverTheModelledArea) {
  for (const double radius_mm : {4.0, 6.0, 8.0}) {
    const Recording recording = touch_of_disc(radius_mm);
    // The corners of a disc of square elements lose up to 3% of its area to their neighbours.
    EXPECT_NEAR(estimate({recording}) / fraction(recording), 1.0, 0.04) << radius_mm;
  }
}

TEST(EstimatePrior, IsPooledOverAllObjects) {
  // Equal modelled areas: the pooled fraction is the mean.
  const double small = estimate({touch_of_disc(3.0)});
  const double large = estimate({touch_of_disc(8.0)});
  EXPECT_NEAR(estimate({touch_of_disc(3.0), touch_of_disc(8.0)}), (small + large) / 2.0, 1e-3)
      << "the half cell that keeps fractions from 0 and 1";
}

TEST(EstimatePrior, DoesNotDependOnThePriorItIsGiven) {
  Device device = Device::open();
  const Recording recording = touch_of_disc(6.0);
  const std::vector<ObjectTouches> touches{{"disc", all_touches(recording)}};
  EXPECT_EQ(estimate_prior(device, touches, {.sensor = {.prior = 0.01}}),
            estimate_prior(device, touches, {.sensor = {.prior = 0.9}}));
}

TEST(EstimatePrior, StaysBetweenZeroAndOne) {
  Recording all = touch_of_disc(100.0);
  EXPECT_LT(estimate({all}), 1.0);
  EXPECT_GT(estimate({all}), 0.99);
  // A dead element hides the only contact; the largest pressure of the rest makes them No Contact
  // or, the largest itself, Unknown.
  Recording none = touch_of_disc(0.0);
  none.pressure.front() = 1.0;
  EXPECT_GT(estimate({none}), 0.0);
  EXPECT_LT(estimate({none}), 0.01);
}

}  // namespace palpate::prior_test
