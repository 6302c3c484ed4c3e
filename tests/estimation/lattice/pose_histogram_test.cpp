#include "palpate/pose_histogram.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <gtest/gtest.h>

#include "palpate/pose.hpp"
#include "support/synthetic.hpp"

namespace palpate::pose_histogram_test {

HistogramOptions small_options() {
  HistogramOptions options;
  options.lattice = {.x_mm = {-5.0, 5.0, 9}, .y_mm = {-5.0, 5.0, 8}, .theta_rad = {0, two_pi, 6}};
  return options;
}

std::vector<Hypothesis> three_objects() {
  return {{random_map(31, 27, 0.5, 4.0, 81), 1.0},
          {random_map(25, 25, 0.5, 4.0, 82), 1.0},
          {random_map(14, 15, 1.0, 4.0, 83), 1.0}};
}

/// Log-likelihoods of all objects, one after another.
std::vector<double> all_bins(const PoseHistogram& histogram, std::size_t objects) {
  std::vector<double> all;
  for (std::size_t object = 0; object < objects; ++object) {
    const std::vector<double> bins = histogram.log_likelihood(static_cast<int>(object));
    all.insert(all.end(), bins.begin(), bins.end());
  }
  return all;
}

TEST(PoseHistogram, StartsUniformAndReturnsToIt) {
  const std::vector<Hypothesis> objects = three_objects();
  Device device = Device::open();
  PoseHistogram histogram(device, objects, small_options());
  const Recording recording = random_recording(2, 36, 84);
  for (const bool after_reset : {false, true}) {
    const Estimate estimate = histogram.estimate();
    EXPECT_EQ(estimate.mode.object, 0) << "ties go to the first object";
    EXPECT_EQ(estimate.mode.bin, 0) << "ties go to the lowest bin";
    EXPECT_EQ(estimate.mode.log_likelihood, 0.0);
    for (const double p : estimate.identity) {
      EXPECT_NEAR(p, 1.0 / 3.0, 1e-15) << "rounding of thirds";
    }
    EXPECT_EQ(all_bins(histogram, 3), std::vector<double>(3 * 9 * 8 * 6, 0.0));
    histogram.update(all_touches(recording));
    EXPECT_NE(histogram.estimate().mode.log_likelihood, 0.0) << after_reset;
    histogram.reset();
  }
}

TEST(PoseHistogram, HasTheEntropyOfItsBins) {
  std::vector<Hypothesis> objects = three_objects();
  objects[1].weight = 3.0;
  HistogramOptions options = small_options();
  const Recording recording = random_recording(4, 36, 87);
  Device device = Device::open();
  for (const auto& none_weight : {std::optional<double>(), std::optional(2.0)}) {
    options.none_weight = none_weight;
    PoseHistogram histogram(device, objects, options);
    // 0.2, 0.6 and 0.2 of log(432) nats each, and the entropy of these three.
    EXPECT_NEAR(histogram.entropy(), std::log(9.0 * 8.0 * 6.0) + 0.950271, 1e-5)
        << "rounding of the expected value, and what is left out";
    for (std::size_t touch = 0; touch < recording.size(); ++touch) {
      histogram.update(recording.touch(touch));
      // Plainly, in float64, over all bins at once.
      std::vector<double> logs;
      for (std::size_t object = 0; object < objects.size(); ++object) {
        for (const double log_likelihood : histogram.log_likelihood(static_cast<int>(object))) {
          logs.push_back(std::log(objects[object].weight) + log_likelihood);
        }
      }
      const double most = *std::max_element(logs.begin(), logs.end());
      double sum = 0.0;
      for (const double log : logs) {
        sum += std::exp(log - most);
      }
      double expected = 0.0;
      for (const double log : logs) {
        const double log_p = log - most - std::log(sum);
        expected -= std::exp(log_p) * log_p;
      }
      // The sums of the reduction are float32.
      EXPECT_NEAR(histogram.entropy(), expected, 1e-4) << "after touch " << touch;
    }
  }
}

TEST(PoseHistogram, AgreesWithTheReferenceInIdentityModeAndMarginals) {
  std::vector<Hypothesis> objects = three_objects();
  objects[1].weight = 3.0;
  objects[2].weight = 0.25;
  const HistogramOptions options = small_options();
  const Recording recording = random_recording(3, 5, 85);
  Device device = Device::open();
  PoseHistogram histogram(device, objects, options);
  for (std::size_t touches = 0; touches <= recording.size(); ++touches) {
    if (touches > 0) {
      histogram.update(recording.touch(touches - 1));
    }
    const reference::Posterior expected =
        reference_posterior(objects, options, recording.touches(0, touches));
    const Estimate estimate = histogram.estimate();
    // An error of e nats changes a probability by at most e.
    const double tolerance = per_touch * static_cast<double>(touches) + 1e-6;
    EXPECT_LT(largest_difference(estimate.identity, reference::identity(expected)), tolerance);

    const reference::Mode mode = reference::mode(expected);
    const auto bin = static_cast<std::size_t>(estimate.mode.bin.value());
    EXPECT_EQ(estimate.mode.object, mode.object);
    EXPECT_NEAR(estimate.mode.log_likelihood, expected.log_likelihood[mode.object][mode.bin],
                tolerance);
    EXPECT_NEAR(expected.log_likelihood[mode.object][bin],
                expected.log_likelihood[mode.object][mode.bin], 2.0 * tolerance);
    EXPECT_EQ(estimate.mode.T_object_robot.theta_rad,
              options.lattice.T_object_robot(*estimate.mode.bin).theta_rad);

    double total = 0.0;
    for (int object = 0; object < 3; ++object) {
      const auto [grid, xy, theta] = histogram.marginals(object);
      EXPECT_LT(largest_difference(xy, reference::marginal_xy(expected, object)), tolerance);
      EXPECT_LT(largest_difference(theta, reference::marginal_theta(expected, object)), tolerance);
      double sum_xy = 0.0;
      double sum_theta = 0.0;
      for (const double p : xy) {
        sum_xy += p;
      }
      for (const double p : theta) {
        sum_theta += p;
      }
      // Sums of some hundred float32 terms of one order.
      EXPECT_NEAR(sum_xy, estimate.identity[object], 1e-6);
      EXPECT_NEAR(sum_theta, estimate.identity[object], 1e-6);
      total += estimate.identity[object];
    }
    EXPECT_NEAR(total, 1.0, 1e-15) << "rounding";
  }
}

TEST(PoseHistogram, WeightsMoveTheIdentityAndTheModeButNoLikelihood) {
  std::vector<Hypothesis> objects(2, {random_map(31, 27, 0.5, 4.0, 86), 1.0});
  const Recording recording = random_recording(2, 36, 87);
  Device device = Device::open();
  PoseHistogram even(device, objects, small_options());
  objects[1].weight = 4.0;
  PoseHistogram weighted(device, objects, small_options());
  even.update(all_touches(recording));
  weighted.update(all_touches(recording));
  EXPECT_EQ(all_bins(even, 2), all_bins(weighted, 2));
  EXPECT_EQ(even.estimate().mode.object, 0);
  EXPECT_EQ(weighted.estimate().mode.object, 1);
  EXPECT_EQ(weighted.estimate().mode.log_likelihood, even.estimate().mode.log_likelihood);
  EXPECT_NEAR(weighted.estimate().identity[1], 0.8, 1e-15) << "rounding";
}

TEST(PoseHistogram, TakesTheMapsPriorUnlessOneIsGiven) {
  std::vector<Hypothesis> objects = three_objects();
  for (Hypothesis& object : objects) {
    object.map.prior = 0.35;
  }
  const Recording recording = random_recording(2, 36, 103);
  HistogramOptions options = small_options();
  Device device = Device::open();
  PoseHistogram own(device, objects, options);
  own.update(all_touches(recording));
  for (const double prior : {0.35, 0.1}) {
    options.contact.prior = prior;
    PoseHistogram given(device, objects, options);
    given.update(all_touches(recording));
    EXPECT_EQ(all_bins(own, 3) == all_bins(given, 3), prior == 0.35);
    EXPECT_LT(
        likelihood_error(given, reference_posterior(objects, options, all_touches(recording))),
        2.0 * per_touch);
  }
}

TEST(PoseHistogram, IdenticalObjectsShareTheProbability) {
  const std::vector<Hypothesis> objects(2, {random_map(31, 27, 0.5, 12.0, 88), 1.0});
  const Recording recording = random_recording(9, 36, 89);
  Device device = Device::open();
  PoseHistogram histogram(device, objects, small_options());
  histogram.update(all_touches(recording));
  EXPECT_EQ(histogram.estimate().identity, (std::vector<double>{0.5, 0.5}));
  EXPECT_EQ(histogram.estimate().mode.object, 0);
}

TEST(PoseHistogram, ATwofoldSymmetricMapCannotTellHalfATurn) {
  OccupancyGrid map = random_map(31, 27, 0.5, 4.0, 90);
  for (std::size_t i = 0; i < map.log_odds.size() / 2; ++i) {
    map.log_odds[map.log_odds.size() - 1 - i] = map.log_odds[i];
  }
  const Hypothesis hypothesis{map, 1.0};
  const HistogramOptions options = small_options();
  const Recording recording = random_recording(3, 36, 91);
  Device device = Device::open();
  PoseHistogram histogram(device, std::span(&hypothesis, 1), options);
  histogram.update(all_touches(recording));
  const std::vector<double> theta = histogram.marginals(0).theta;
  for (std::size_t t = 0; t < 3; ++t) {
    EXPECT_NEAR(theta[t], theta[t + 3], 1e-4) << "the tolerance of one touch";
  }
  // Half a turn about the object's origin takes (x, y, theta) to (-x, -y, theta + pi).
  const std::vector<double> bins = histogram.log_likelihood(0);
  const std::int64_t plane = options.lattice.plane();
  for (std::int64_t t = 0; t < 3; ++t) {
    for (std::int64_t i = 0; i < plane; ++i) {
      ASSERT_NEAR(bins[t * plane + i], bins[(t + 3) * plane + plane - 1 - i], 3.0 * per_touch);
    }
  }
}

TEST(PoseHistogram, MovesWithTheRobotFrame) {
  const Hypothesis hypothesis{random_map(31, 27, 0.5, 4.0, 92), 1.0};
  const Recording recording = random_recording(3, 36, 93);
  const HistogramOptions options = small_options();
  // A turn by two bins takes the lattice about the moved pivot onto itself.
  const Pose T_moved_robot{{123.0, -45.0}, 2.0 * options.lattice.theta_rad.step()};
  HistogramOptions moved_options = options;
  moved_options.lattice.pivot_mm = T_moved_robot * options.lattice.pivot_mm;
  Device device = Device::open();
  PoseHistogram here(device, std::span(&hypothesis, 1), options);
  PoseHistogram there(device, std::span(&hypothesis, 1), moved_options);
  here.update(all_touches(recording));
  there.update(all_touches(moved(recording, T_moved_robot)));

  std::vector<double> expected = here.log_likelihood(0);
  std::rotate(expected.begin(), expected.begin() + 2 * options.lattice.plane(), expected.end());
  EXPECT_LT(largest_difference(there.log_likelihood(0), expected), 3.0 * per_touch);

  const Pose moved_estimate = here.estimate().mode.T_object_robot * inverse(T_moved_robot);
  const Pose estimate = there.estimate().mode.T_object_robot;
  const double turn = wrap_angle(estimate.theta_rad - moved_estimate.theta_rad, two_pi);
  EXPECT_NEAR(turn, 0.0, 1e-12) << "float64 rounding";
  EXPECT_NEAR(estimate.translation_mm.x, moved_estimate.translation_mm.x, 1e-10) << "rounding";
  EXPECT_NEAR(estimate.translation_mm.y, moved_estimate.translation_mm.y, 1e-10) << "rounding";
}

TEST(PoseHistogram, OrderOfTouchesDoesNotMatter) {
  const std::vector<Hypothesis> objects = three_objects();
  const Recording recording = random_recording(20, 36, 94);
  std::vector<Touch> touches = all_touches(recording);
  Device device = Device::open();
  PoseHistogram forwards(device, objects, small_options());
  PoseHistogram backwards(device, objects, small_options());
  forwards.update(touches);
  std::reverse(touches.begin(), touches.end());
  backwards.update(touches);
  // Two floats keep 14 digits of some hundred nats; the segments' own sums are the same.
  EXPECT_LT(largest_difference(all_bins(forwards, 3), all_bins(backwards, 3)), 1e-9);
}

TEST(PoseHistogram, TouchesAtOnceOrOneByOneGiveTheSameBits) {
  const std::vector<Hypothesis> objects = three_objects();
  const Recording recording = random_recording(20, 36, 95);
  Device device = Device::open();
  PoseHistogram at_once(device, objects, small_options());
  PoseHistogram one_by_one(device, objects, small_options());
  at_once.update(all_touches(recording));
  for (const Touch& touch : all_touches(recording)) {
    one_by_one.update(touch);
    one_by_one.estimate();  // looking changes nothing
  }
  EXPECT_EQ(all_bins(at_once, 3), all_bins(one_by_one, 3));
  EXPECT_EQ(at_once.estimate().identity, one_by_one.estimate().identity);
}

TEST(PoseHistogram, TheSameInputGivesTheSameBits) {
  const std::vector<Hypothesis> objects = three_objects();
  const Recording recording = random_recording(9, 36, 96);
  const auto run = [&] {
    Device device = Device::open();
    PoseHistogram histogram(device, objects, small_options());
    histogram.update(all_touches(recording));
    std::vector<double> all = all_bins(histogram, 3);
    for (const int object : {0, 1, 2}) {
      const Marginals marginals = histogram.marginals(object);
      all.insert(all.end(), marginals.xy.begin(), marginals.xy.end());
      all.insert(all.end(), marginals.theta.begin(), marginals.theta.end());
    }
    const Estimate estimate = histogram.estimate();
    all.insert(all.end(), estimate.identity.begin(), estimate.identity.end());
    return all;
  };
  EXPECT_EQ(run(), run());
}

TEST(PoseHistogram, UnknownElementsAndTouchesChangeNoBit) {
  const std::vector<Hypothesis> objects = three_objects();
  const Recording known = random_recording(3, 36, 97);
  Recording more = known;
  more.elements_mm.emplace_back(0.3, 0.2);
  more.pressure.clear();
  for (std::size_t i = 0; i < known.size(); ++i) {
    const std::span<const double> row = known.touch(i).pressure;
    more.pressure.insert(more.pressure.end(), row.begin(), row.end());
    more.pressure.push_back(2.0);
  }
  Device device = Device::open();
  PoseHistogram one(device, objects, small_options());
  PoseHistogram other(device, objects, small_options());
  one.update(all_touches(known));
  other.update(all_touches(more));
  EXPECT_EQ(all_bins(one, 3), all_bins(other, 3));

  Recording unknown = random_recording(2, 36, 98);
  unknown.pressure.assign(unknown.pressure.size(), 1.0);
  other.update(all_touches(unknown));
  other.update(std::span<const Touch>{});
  other.update(all_touches(random_recording(2, 0, 99)));
  EXPECT_EQ(all_bins(one, 3), all_bins(other, 3));
  EXPECT_EQ(one.estimate().identity, other.estimate().identity);
}

TEST(PoseHistogram, ADimensionOfZeroExtentCostsOneBin) {
  const Hypothesis hypothesis{random_map(31, 27, 0.5, 4.0, 100), 1.0};
  HistogramOptions options;
  options.lattice = {.x_mm = {1.0, 1.0, 25}, .y_mm = {-5, 5, 7}, .theta_rad = {0.5, 0.5, 16}};
  Device device = Device::open();
  PoseHistogram histogram(device, std::span(&hypothesis, 1), options);
  EXPECT_EQ(histogram.lattice().bins(), 7);
  EXPECT_EQ(histogram.log_likelihood(0).size(), 7U);
  const Pose pose = histogram.estimate().mode.T_object_robot;
  EXPECT_EQ(pose.translation_mm.x, 1.0);
  EXPECT_EQ(pose.theta_rad, 0.5);
}

TEST(PoseHistogram, OnlyListedObjectsCostMemory) {
  const std::vector<Hypothesis> objects = three_objects();
  HistogramOptions options;
  options.lattice.x_mm.count = 64;
  options.lattice.y_mm.count = 64;
  const Recording recording = random_recording(9, 36, 101);
  Device device = Device::open();
  const auto bytes = [&](std::span<const Hypothesis> listed) {
    PoseHistogram histogram(device, listed, options);
    histogram.update(all_touches(recording));
    return histogram.device_bytes();
  };
  const std::uint64_t one = bytes(std::span(objects).first(1));
  const std::uint64_t two = bytes(std::span(objects).first(2));
  const std::uint64_t per_object = options.lattice.bins() * 2 * sizeof(float);
  EXPECT_GT(two - one, per_object);
  // Beside its bins an object has its map, its axes and partial sums.
  EXPECT_LT(two - one, per_object + 20000);
  EXPECT_LT(one, 2 * per_object);
}

TEST(PoseHistogram, MovesWithItsBelief) {
  const std::vector<Hypothesis> objects = three_objects();
  const Recording recording = random_recording(2, 36, 102);
  Device device = Device::open();
  PoseHistogram first(device, objects, small_options());
  first.update(recording.touch(0));
  PoseHistogram second(std::move(first));
  second.update(recording.touch(1));
  PoseHistogram whole(device, objects, small_options());
  whole.update(all_touches(recording));
  EXPECT_EQ(all_bins(second, 3), all_bins(whole, 3));
}

}  // namespace palpate::pose_histogram_test
