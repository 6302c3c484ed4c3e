#include "estimation/lattice/expected_gain.hpp"

#include <cmath>
#include <numeric>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "beliefs.hpp"
#include "model/displacement_points.hpp"
#include "palpate/error.hpp"

namespace palpate::expected_gain_test {

// Few enough elements that all 64 readings can be listed.
const std::vector<glm::dvec2> elements{{-2.0, -1.0}, {0.0, -1.2}, {2.1, -1.0},
                                       {-1.9, 1.0},  {0.3, 1.0},  {2.0, 1.1}};
const ContactModel contact{.prior = 0.2};

std::vector<OccupancyGrid> maps_of(std::span<const Hypothesis> objects) {
  std::vector<OccupancyGrid> maps;
  for (const Hypothesis& object : objects) {
    maps.push_back(object.map);
  }
  return maps;
}

std::vector<PoseSample> random_samples(std::size_t count) {
  Uniform uniform(21);
  std::vector<PoseSample> samples;
  for (std::size_t i = 0; i < count; ++i) {
    samples.push_back({.object = static_cast<int>(i % 3),
                       .T_object_robot = {{uniform(-3, 3), uniform(-3, 3)}, uniform(0, two_pi)}});
  }
  return samples;
}

reference::Gain exact_gain(std::span<const PoseSample> samples, std::span<const Hypothesis> objects,
                           const std::vector<std::size_t>& label_of, const Pose& candidate,
                           const DisplacementSd& touch_sd = {}) {
  std::vector<reference::BeliefSample> belief;
  for (const PoseSample& sample : samples) {
    const auto object = static_cast<std::size_t>(sample.object);
    belief.push_back({.object = object,
                      .label = label_of.empty() ? object : label_of[object],
                      .T_object_robot = sample.T_object_robot,
                      .probability = 1.0 / static_cast<double>(samples.size())});
  }
  return reference::expected_gain(belief, maps_of(objects), candidate, elements, contact,
                                  displacement_points(touch_sd, 64));
}

/// Mean and its standard error over seeds.
struct Estimated {
  double mean = 0.0;
  double error = 0.0;
};
Estimated estimated(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  double squares = 0.0;
  for (const double value : values) {
    squares += (value - mean) * (value - mean);
  }
  return {mean, std::sqrt(squares / (n - 1.0) / n)};
}

/// What a gain is on average over so many seeds, and says of its own errors.
struct AverageGain {
  Estimated identity;
  Estimated both;
  TouchGain::StandardError stated;
};
template <class GainOfSeed>
AverageGain average(int seeds, const GainOfSeed& gain_of) {
  std::vector<double> identity;
  std::vector<double> both;
  AverageGain average;
  for (int seed = 0; seed < seeds; ++seed) {
    const TouchGain gain = gain_of(static_cast<std::uint64_t>(seed));
    identity.push_back(gain.identity);
    both.push_back(gain.both());
    average.stated.identity += gain.standard_error.identity / seeds;
    average.stated.both += gain.standard_error.both / seeds;
  }
  average.identity = estimated(identity);
  average.both = estimated(both);
  return average;
}

TEST(ExpectedGain, IsTheMutualInformationOfItsSamples) {
  const std::vector<Hypothesis> objects = three_objects();
  const PredictedReadings predicted(objects, contact);
  const std::vector<PoseSample> samples = random_samples(40);
  for (const auto& label_of : {std::vector<std::size_t>{}, std::vector<std::size_t>{0, 1, 0}}) {
    for (const Pose& candidate : {Pose{{1.0, 0.5}, 0.4}, Pose{{-2.0, 3.0}, 2.0}}) {
      const AverageGain gain = average(300, [&](std::uint64_t seed) {
        return expected_gain(predicted, samples, std::span(&candidate, 1), elements, {},
                             {.seed = seed, .label_of = label_of})
            .front();
      });
      const reference::Gain exact = exact_gain(samples, objects, label_of, candidate);
      EXPECT_GT(exact.identity, 0.03);
      EXPECT_GT(exact.both, exact.identity + 0.1);
      // Four standard errors, and what the predicted tables are off by.
      EXPECT_NEAR(gain.identity.mean, exact.identity, 4.0 * gain.identity.error + 1e-3);
      EXPECT_LT(gain.identity.error, 0.01) << "or the test would see nothing";
      EXPECT_NEAR(gain.both.mean, exact.both, 4.0 * gain.both.error + 1e-3);
      EXPECT_LT(gain.both.error, 0.015);
    }
  }
}

TEST(ExpectedGain, AveragesOverWhereTheSensorMayHaveBeen) {
  // Cells as wide as an object's features are on a real one.
  const std::vector<Hypothesis> objects{{random_map(9, 9, 3.0, 4.0, 81)},
                                        {random_map(8, 9, 3.0, 4.0, 82)},
                                        {random_map(9, 8, 3.0, 4.0, 83)}};
  const PredictedReadings predicted(objects, contact);
  const std::vector<PoseSample> samples = random_samples(40);
  const Pose candidate{{1.0, 0.5}, 0.4};
  const DisplacementSd touch_sd{.mm = 1.0, .rad = 0.1};
  const AverageGain gain = average(300, [&](std::uint64_t seed) {
    return expected_gain(predicted, samples, std::span(&candidate, 1), elements, touch_sd,
                         {.seed = seed})
        .front();
  });
  const double exact = exact_gain(samples, objects, {}, candidate, touch_sd).both;
  EXPECT_LT(exact, exact_gain(samples, objects, {}, candidate).both - 0.1);
  // Six displacements stand for all: they tell a little more than all would.
  EXPECT_NEAR(gain.both.mean, exact, 0.08);
}

/// A lattice of four places in a row, known up to 1 mm, after one touch.
class TouchedGain : public testing::Test {
 protected:
  TouchedGain() { histogram.update(random_recording(1, 9, 85).touch(0)); }

  TouchGain gain_of(const Pose& candidate, const PlanOptions& plan,
                    std::span<const glm::dvec2> array = elements) const {
    return histogram.expected_gain(std::span(&candidate, 1), array, plan).front();
  }

  const Pose candidate{{1.0, 0.5}, 0.4};
  const PoseLattice lattice{
      .x_mm = {-2.0, 2.0, 4}, .y_mm = {0.5, 0.5, 1}, .theta_rad = {0.3, 0.3, 1}};
  const std::vector<Hypothesis> objects = three_objects();
  PoseHistogram histogram{shared_device(), objects, {.lattice = lattice, .contact = contact}};
};

TEST_F(TouchedGain, OfAHistogramIsThatOfItsBins) {
  // The belief is uniform within a bin: eight places of each stand for all.
  std::vector<reference::BeliefSample> belief;
  for (std::size_t object = 0; object < 3; ++object) {
    const Marginals marginals = histogram.marginals(static_cast<int>(object));
    for (int part = 0; part < 4 * 8; ++part) {
      const double x = lattice.x_mm.centre(part / 8) + (part % 8 - 3.5) / 8.0;
      belief.push_back({.object = object,
                        .label = object,
                        .T_object_robot = lattice.T_object_robot(x, 0.5, 0.3),
                        .probability = marginals.xy[part / 8] / 8.0});
    }
  }
  const reference::Gain exact = reference::expected_gain(belief, maps_of(objects), candidate,
                                                         elements, contact, std::array{Pose{}});
  const AverageGain gain = average(
      40, [&](std::uint64_t seed) { return gain_of(candidate, {.samples = 512, .seed = seed}); });
  // Finite samples tell on average (samples per bin, 8 readings that matter) some 0.01 more.
  EXPECT_NEAR(gain.identity.mean, exact.identity, 0.02);
  EXPECT_NEAR(gain.both.mean, exact.both, 0.02);
  EXPECT_GT(exact.both, 0.2);
}

TEST(ExpectedGain, IsNeverBelowZero) {
  const std::vector<Hypothesis> objects = three_objects();
  const PredictedReadings predicted(objects, contact);
  std::vector<Pose> candidates;
  for (int i = 0; i < 20; ++i) {
    candidates.push_back({{4.0 * i, 0.5 * i}, 0.3 * i});  // the later, the less they touch
  }
  for (const std::size_t count : {2U, 3U, 16U}) {
    const std::vector<PoseSample> samples = random_samples(count);
    for (const DisplacementSd& touch_sd : {DisplacementSd{}, DisplacementSd{1.0, 0.1}}) {
      for (std::uint64_t seed = 0; seed < 20; ++seed) {
        for (const TouchGain& gain :
             expected_gain(predicted, samples, candidates, elements, touch_sd, {.seed = seed})) {
          EXPECT_GE(gain.identity, 0.0);
          EXPECT_GE(gain.pose, 0.0);
          EXPECT_LE(gain.both(), std::log(static_cast<double>(count)) + 1e-5);
          EXPECT_GE(gain.standard_error.both, 0.0) << "and is a number";
        }
      }
    }
  }
}

TEST_F(TouchedGain, KnowsItsErrorAboutALongRun) {
  const std::vector<glm::dvec2> array = digitacts_array();
  for (const Pose& pose : {candidate, Pose{{7.0, -3.0}, 2.0}}) {
    const TouchGain long_run = gain_of(pose, {.samples = 2048, .seed = 1000}, array);
    constexpr int seeds = 60;
    const AverageGain gain = average(seeds, [&](std::uint64_t seed) {
      return gain_of(pose, {.samples = 96, .seed = seed}, array);
    });
    // A fourteenth of a bin's poses lies in a sample: gains come out too small.
    EXPECT_NEAR(gain.identity.mean, long_run.identity, 0.03);
    EXPECT_NEAR(gain.both.mean, long_run.both(), 0.15);
    // Drawn samples err a little more than simulated readings show.
    const auto expect_like = [](double stated, const Estimated& of) {
      const double deviation = std::sqrt(static_cast<double>(seeds)) * of.error;
      EXPECT_GT(stated, 0.5 * deviation);
      EXPECT_LT(stated, 2.0 * deviation);
    };
    expect_like(gain.stated.identity, gain.identity);
    expect_like(gain.stated.both, gain.both);
  }
}

TEST_F(TouchedGain, IsReproducibleAndTheSameAmongOtherCandidates) {
  std::vector<Pose> candidates;
  for (int i = 0; i < 40; ++i) {
    candidates.push_back({{0.2 * i - 4.0, 0.1 * i}, 0.3 * i});
  }
  const auto gains = [&](std::span<const Pose> poses, std::uint64_t seed) {
    std::vector<double> values;
    for (const TouchGain& gain : histogram.expected_gain(poses, elements, {.seed = seed})) {
      values.push_back(gain.identity);
      values.push_back(gain.pose);
    }
    return values;
  };
  const std::vector<double> all = gains(candidates, 5);
  EXPECT_EQ(gains(candidates, 5), all);
  EXPECT_NE(gains(candidates, 6), all);
  EXPECT_EQ(gains(std::span(candidates).subspan(17, 1), 5), (std::vector{all[34], all[35]}));
}

TEST(ExpectedGain, SlipMovesObjectsAboutTheirMiddle) {
  const Body body{.centroid_mm = {30.0, -10.0}};
  const PoseSample start{.object = 0, .T_object_robot = {{2.0, 1.0}, 0.7}};
  std::vector<PoseSample> samples(4000, start);
  slip(samples, std::span(&body, 1), {.mm = 0.5, .rad = 0.1}, 3);
  // Where the robot finds the centroid of the object that has slipped, seen from where it was.
  double squares = 0.0;
  double turns = 0.0;
  for (const PoseSample& sample : samples) {
    const glm::dvec2 now =
        start.T_object_robot * (inverse(sample.T_object_robot) * body.centroid_mm);
    squares += glm::dot(now - body.centroid_mm, now - body.centroid_mm) / 2.0;
    const double turn = sample.T_object_robot.theta_rad - start.T_object_robot.theta_rad;
    turns += turn * turn;
  }
  // Relative errors of a variance from 8000 and 4000 draws: 1.6 and 2.2 %.
  EXPECT_NEAR(squares / 4000.0, 0.25, 0.05 * 0.25);
  EXPECT_NEAR(turns / 4000.0, 0.01, 0.08 * 0.01);
}

TEST_F(TouchedGain, IsRefusedOfWhatCannotBeRanked) {
  const std::vector<Pose> one(1);
  const std::vector<Pose> unknown{Pose{}, unknown_pose};
  const std::vector<glm::dvec2> nan{{0.0, std::nan("")}};
  EXPECT_THROW(histogram.expected_gain({}, elements), Error);
  EXPECT_THROW(histogram.expected_gain(one, {}), Error);
  EXPECT_THROW(histogram.expected_gain(unknown, elements), Error);
  EXPECT_THROW(histogram.expected_gain(one, nan), Error);
  EXPECT_THROW(histogram.expected_gain(one, elements, {.samples = 1}), Error);
  EXPECT_THROW(histogram.expected_gain(one, elements, {.samples = 5000}), Error);
  EXPECT_THROW(histogram.expected_gain(one, elements, {.label_of = {0, 1}}), Error);
}

}  // namespace palpate::expected_gain_test
