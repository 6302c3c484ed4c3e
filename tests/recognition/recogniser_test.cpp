#include "recogniser.hpp"

#include <algorithm>
#include <numeric>

#include <gtest/gtest.h>

#include "palpate/error.hpp"
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

double sum_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
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
  EXPECT_EQ(recogniser.marginals(0).xy, histogram.marginals(0).xy);
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
    const auto [grid, xy, theta] = recogniser.marginals(object);
    EXPECT_EQ(grid.bins(), 400 * 16);
    EXPECT_EQ(xy.size(), 400U);
    EXPECT_EQ(theta.size(), 16U);
    // Every particle lies in a bin; the sums differ in their order.
    EXPECT_NEAR(sum_of(xy), estimate.identity[object], 1e-9);
    EXPECT_NEAR(sum_of(theta), estimate.identity[object], 1e-9);
  }
}

TEST(Recogniser, FindsParticlesAndHistogramInTheSamePlace) {
  Device device = Device::open();
  const Recording recording = touched_letter(5);
  std::vector<Marginals> marginals;
  for (const FilterOptions& filter : both_filters()) {
    Recogniser recogniser(device, RecognitionTask(shapes(), filter));
    recogniser.update(all_touches(recording));
    marginals.push_back(recogniser.marginals(0));
  }
  const auto most = [](const std::vector<double>& sums) {
    return std::max_element(sums.begin(), sums.end()) - sums.begin();
  };
  // Noise of 1 mm and 0.1 rad at every touch spreads particles over two bins of 0.5 mm; theta's
  // bins of 22.5 degrees are four times as wide.
  const std::ptrdiff_t a = most(marginals[0].xy);
  const std::ptrdiff_t b = most(marginals[1].xy);
  EXPECT_LE(std::abs(a % 20 - b % 20), 4);
  EXPECT_LE(std::abs(a / 20 - b / 20), 4);
  const std::ptrdiff_t turn = most(marginals[0].theta) - most(marginals[1].theta);
  EXPECT_LE(std::abs((turn + 24) % 16 - 8), 1);
}

TEST(Recogniser, TakesInAllTouchesOfACallOrNone) {
  Device device = Device::open();
  const Recording recording = touched_letter(3);
  std::vector<Touch> touches = all_touches(recording);
  for (const FilterOptions& filter : both_filters()) {
    Recogniser recogniser(device, RecognitionTask(shapes(), filter));
    recogniser.update(std::span(touches).first(1));
    const Estimate before = recogniser.estimate();
    std::vector<Touch> unsound = touches;
    unsound.back().pressure = unsound.back().pressure.first(1);
    EXPECT_THROW(recogniser.update(unsound), Error);
    expect_same(recogniser.estimate(), before);
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
