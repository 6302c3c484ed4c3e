#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "gpu/context.hpp"
#include "palpate/pose_histogram.hpp"
#include "synthetic.hpp"

namespace palpate::prepared_touch_test {

const std::vector<Hypothesis>& objects() {
  static const std::vector<Hypothesis> two{{random_map(31, 27, 0.5, 12.0, 162), 1.0},
                                           {random_map(23, 29, 0.5, 12.0, 163), 1.0}};
  return two;
}

HistogramOptions options_of(double step_mm) {
  HistogramOptions options;
  options.lattice = {.x_mm = {-3.0, -3.0 + 11 * step_mm, 11},
                     .y_mm = {-2.0, -2.0 + 9 * step_mm, 9},
                     .theta_rad = {0.0, 3.0, 5}};
  return options;
}

std::vector<std::vector<double>> told_by(const PoseHistogram& histogram) {
  return {histogram.log_likelihood(0), histogram.log_likelihood(1)};
}

/// Two of three touches are used; the third is another one.
class PreparedTouch : public testing::Test {
 protected:
  Device device = Device::open();
  const Recording recording = random_recording(3, 60, 161);
  const std::vector<Touch> touches = all_touches(recording);
};

TEST_F(PreparedTouch, ChangesNothingBeforeItComes) {
  PoseHistogram histogram(device, objects(), options_of(0.1));
  histogram.update(touches[0]);
  const auto before = told_by(histogram);
  histogram.prepare(touches[1]);
  EXPECT_EQ(told_by(histogram), before);
}

TEST_F(PreparedTouch, GivesTheReferencesLikelihoodOnEveryPath) {
  for (const double step_mm : {0.1, 0.25, 0.8}) {
    const HistogramOptions options = options_of(step_mm);
    PoseHistogram histogram(device, objects(), options);
    for (const Touch& touch : touches) {
      histogram.prepare(touch);
      histogram.update(touch);
    }
    // 1e-4 nats per 36 elements and touch.
    EXPECT_LT(likelihood_error(histogram, reference_posterior(objects(), options, touches)),
              1e-4 * 3 * 60.0 / 36.0);
  }
}

TEST_F(PreparedTouch, IsAddedAndNotEvaluatedAgain) {
  PoseHistogram plain(device, objects(), options_of(0.1));
  PoseHistogram prepared(device, objects(), options_of(0.1));
  std::vector<double> plain_progress;
  std::vector<double> prepared_progress;
  for (const Touch& touch : touches) {
    plain.update(std::span(&touch, 1), [&](double done) { plain_progress.push_back(done); });
    prepared.prepare(touch);
    prepared.update(std::span(&touch, 1), [&](double done) { prepared_progress.push_back(done); });
  }
  // So few bins are done before there is any progress; what was prepared is done at once.
  EXPECT_EQ(plain_progress, std::vector<double>());
  EXPECT_EQ(prepared_progress, (std::vector{1.0, 1.0, 1.0}));
}

TEST_F(PreparedTouch, CountsForAContradictionAsAnyOther) {
  // So sure of all that it says that touches of no object cost every pose 1,000 nats, and so wide
  // that no pose leaves the array on what was never seen.
  const std::vector<Hypothesis> sure{{random_map(121, 121, 0.5, 1000.0, 164), 1.0}};
  HistogramOptions options = options_of(0.8);
  options.contact.gamma = 0.0;
  PoseHistogram prepared(device, sure, options);
  EXPECT_FALSE(prepared.estimate().contradicted);
  for (const Touch& touch : touches) {
    prepared.prepare(touch);
    prepared.prepare(touch);
    prepared.update(touch);
    EXPECT_TRUE(prepared.estimate().contradicted);
  }
}

TEST_F(PreparedTouch, ThatDoesNotComeCostsNoBit) {
  PoseHistogram plain(device, objects(), options_of(0.8));
  PoseHistogram prepared(device, objects(), options_of(0.8));
  // Another touch, several at once, and the same readings elsewhere.
  Touch elsewhere = touches[2];
  elsewhere.T_robot_sensor.translation_mm.x += 0.25;
  for (PoseHistogram* histogram : {&plain, &prepared}) {
    const auto prepare = [&](const Touch& touch) {
      if (histogram == &prepared) {
        histogram->prepare(touch);
      }
    };
    prepare(touches[2]);
    histogram->update(touches[0]);
    prepare(touches[0]);
    histogram->update(std::span(touches).first(2));
    prepare(elsewhere);
    histogram->update(touches[2]);
  }
  EXPECT_EQ(told_by(prepared), told_by(plain));
}

TEST_F(PreparedTouch, StaysWithinTheDevicesMemory) {
  HistogramOptions options = options_of(0.1);
  options.lattice.theta_rad.count = 8'000;  // 13 MB for each belief
  const std::uint64_t one_belief = 2 * 8 * static_cast<std::uint64_t>(options.lattice.bins());
  for (const std::uint64_t memory : {4 * one_belief - 1, 4 * one_belief}) {
    Device fresh = Device::open();
    gpu::Limits limits = fresh.context().limits();
    limits.memory = memory;
    fresh.context().lower_limits(limits);
    PoseHistogram histogram(fresh, objects(), options);
    histogram.prepare(touches[0]);
    histogram.update(touches[0]);
    EXPECT_EQ(histogram.device_bytes() > 2 * one_belief, memory == 4 * one_belief);
    EXPECT_LE(fresh.context().memory_use().peak, memory);
  }
}

}  // namespace palpate::prepared_touch_test
