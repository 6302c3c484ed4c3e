#include "recogniser.hpp"

#include <numeric>

#include <gtest/gtest.h>

#include "shapes.hpp"
#include "synthetic.hpp"

namespace palpate {
namespace {

void expect_same(const Estimate& actual, const Estimate& expected) {
  EXPECT_EQ(actual.identity, expected.identity);
  EXPECT_EQ(actual.mode.object, expected.mode.object);
  EXPECT_EQ(actual.mode.T_object_robot.translation_mm, expected.mode.T_object_robot.translation_mm);
  EXPECT_EQ(actual.mode.T_object_robot.theta_rad, expected.mode.T_object_robot.theta_rad);
}

TEST(Recogniser, OfAHistogramTellsWhatTheHistogramTells) {
  Device device = Device::open();
  const auto options = std::get<HistogramOptions>(both_filters()[0]);
  const RecognitionTask task(shapes(), options);
  const Recording recording = touched_letter(1);
  Recogniser recogniser(device, task);
  recogniser.update(all_touches(recording));
  PoseHistogram histogram(device, task.hypotheses, options);
  histogram.update(all_touches(recording));

  const Estimate estimate = histogram.estimate();
  expect_same(recogniser.estimate(), estimate);
  EXPECT_EQ(recogniser.refine(estimate.mode)->T_object_robot.theta_rad,
            histogram.refine(estimate.mode).T_object_robot.theta_rad);
  EXPECT_EQ(recogniser.marginal_xy(0), histogram.marginals(0).xy);
  EXPECT_EQ(recogniser.histogram()->log_likelihood(0), histogram.log_likelihood(0));
  EXPECT_FALSE(recogniser.effective_sample_size());
}

TEST(Recogniser, OfParticlesTellsWhatTheParticlesTell) {
  Device device = Device::open();
  const auto options = std::get<ParticleOptions>(both_filters()[1]);
  const RecognitionTask task(shapes(), options);
  const Recording recording = touched_letter(1);
  Recogniser recogniser(device, task);
  std::vector<double> fractions;
  recogniser.update(all_touches(recording),
                    [&](double fraction) { fractions.push_back(fraction); });
  ParticleFilter particles(device, task.hypotheses, options);
  particles.update(all_touches(recording));

  const Estimate estimate = particles.estimate();
  expect_same(recogniser.estimate(), estimate);
  EXPECT_EQ(recogniser.effective_sample_size(), particles.effective_sample_size());
  EXPECT_FALSE(recogniser.refine(estimate.mode));
  EXPECT_EQ(recogniser.histogram(), nullptr);
  EXPECT_EQ(fractions.size(), 6U);
  EXPECT_EQ(fractions.back(), 1.0);
  for (const int object : {0, 1}) {
    const std::vector<double> belief = recogniser.marginal_xy(object);
    EXPECT_EQ(belief.size(), 400U);
    // Every particle lies in a bin; the sums differ in their order.
    EXPECT_NEAR(std::accumulate(belief.begin(), belief.end(), 0.0), estimate.identity[object],
                1e-9);
  }
}

TEST(Recogniser, ForgetsTheUnknownBefore) {
  Device device = Device::open();
  for (const FilterOptions& filter : both_filters()) {
    const RecognitionTask task(shapes(), filter);
    Recogniser recogniser(device, task);
    const Recording recording = touched_disc(2);
    recogniser.update(all_touches(recording));
    const Estimate first = recogniser.estimate();
    recogniser.update(all_touches(touched_letter(3)));
    recogniser.reset();
    recogniser.update(all_touches(recording));
    expect_same(recogniser.estimate(), first);
  }
}

}  // namespace
}  // namespace palpate
