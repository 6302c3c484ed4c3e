#include "palpate/pose_histogram.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "beliefs.hpp"
#include "model/random.hpp"

namespace palpate::pose_histogram_test {

class PoseHistogramTest : public testing::Test {
 protected:
  PoseHistogram one{shared_device(), three_objects(), {.lattice = small_lattice()}};
  PoseHistogram other{shared_device(), three_objects(), {.lattice = small_lattice()}};
};

TEST_F(PoseHistogramTest, StartsUniformAndReturnsToIt) {
  for (const bool after_reset : {false, true}) {
    const Estimate estimate = one.estimate();
    EXPECT_EQ(estimate.mode.object, 1) << "the largest weight";
    EXPECT_EQ(estimate.mode.bin, 0) << "ties go to the lowest bin";
    EXPECT_EQ(estimate.mode.log_likelihood, 0.0);
    EXPECT_LT(largest_difference(estimate.identity, std::vector{0.25, 0.5, 0.25}), 1e-15);
    // The entropy of these three, and of the bins.
    EXPECT_NEAR(one.entropy(), std::log(9.0 * 10.0 * 12.0) + 1.5 * std::log(2.0), 1e-5);
    EXPECT_EQ(one.log_likelihood(2), std::vector<double>(9 * 10 * 12, 0.0));
    one.update(all_touches(random_recording(2, 36, 84)));
    EXPECT_NE(one.estimate().mode.log_likelihood, 0.0) << after_reset;
    one.reset();
  }
}

TEST_F(PoseHistogramTest, UnknownElementsAndTouchesChangeNoBit) {
  const Recording known = random_recording(3, 36, 97);
  Recording more = known;
  more.elements_mm.emplace_back(0.3, 0.2);
  more.pressure.clear();
  for (const Touch& touch : all_touches(known)) {
    more.pressure.insert(more.pressure.end(), touch.pressure.begin(), touch.pressure.end());
    more.pressure.push_back(2.0);
  }
  one.update(all_touches(known));
  other.update(all_touches(more));
  EXPECT_EQ(all_answers(one), all_answers(other));

  Recording unknown = random_recording(2, 36, 98);
  unknown.pressure.assign(unknown.pressure.size(), 1.0);
  other.update(all_touches(unknown));
  other.update(std::span<const Touch>{});
  other.update(all_touches(random_recording(2, 0, 99)));
  EXPECT_EQ(all_answers(one), all_answers(other));
}

TEST_F(PoseHistogramTest, ADimensionOfZeroExtentCostsOneBin) {
  HistogramOptions options;
  options.lattice = {.x_mm = {1.0, 1.0, 25}, .y_mm = {-5, 5, 7}, .theta_rad = {0.5, 0.5, 16}};
  const PoseHistogram histogram(shared_device(), three_objects(), options);
  EXPECT_EQ(histogram.lattice().bins(), 7);
  EXPECT_EQ(histogram.log_likelihood(0).size(), 7U);
  const Pose pose = histogram.estimate().mode.T_object_robot;
  EXPECT_EQ(pose.translation_mm.x, 1.0);
  EXPECT_EQ(pose.theta_rad, 0.5);
}

TEST_F(PoseHistogramTest, OnlyListedObjectsCostMemory) {
  const std::vector<Hypothesis> objects = three_objects();
  HistogramOptions options;
  options.lattice.x_mm.count = 64;
  options.lattice.y_mm.count = 64;
  const Recording recording = random_recording(2, 36, 101);
  const auto bytes = [&](std::span<const Hypothesis> listed) {
    PoseHistogram histogram(shared_device(), listed, options);
    histogram.update(all_touches(recording));
    return histogram.device_bytes();
  };
  const std::uint64_t first = bytes(std::span(objects).first(1));
  const std::uint64_t both = bytes(std::span(objects).first(2));
  const std::uint64_t per_object = options.lattice.bins() * 2 * sizeof(float);
  EXPECT_GT(both - first, per_object);
  // Beside its bins an object has its map, its axes and partial sums.
  EXPECT_LT(both - first, per_object + 20000);
  EXPECT_LT(first, 2 * per_object);
}

TEST(PoseHistogram, DrawsLieWhereTheirPartsOfTheBeliefDo) {
  PoseLattice lattice = small_lattice();  // of so many bins that most blocks have no draw
  lattice.x_mm.count = lattice.y_mm.count = lattice.theta_rad.count = 60;
  PoseHistogram histogram(shared_device(), three_objects(), {.lattice = lattice});
  histogram.update(all_touches(random_recording(1, 36, 98)));
  constexpr std::uint64_t seed = 99;
  constexpr std::size_t count = 5;
  Random random(seed, Stream::belief);
  const std::vector<double> parts = one_in_each_part(count, random);
  const std::vector<PoseSample> draws = histogram.sample(count, seed);
  ASSERT_EQ(draws.size(), count);
  std::size_t draw = 0;
  double reached = 0.0;
  const std::vector<double> identity = histogram.estimate().identity;
  for (int object = 0; object < 3; ++object) {
    const std::vector<double> logs = histogram.log_likelihood(object);
    const double largest = std::ranges::max(logs);
    double mass = 0.0;
    for (const double log : logs) {
      mass += std::exp(log - largest);
    }
    for (std::size_t bin = 0; bin < logs.size(); ++bin) {
      const double after = reached + identity[object] * std::exp(logs[bin] - largest) / mass;
      if (draw < count && draws[draw].object == object &&
          lattice.bin_of(draws[draw].T_object_robot) == static_cast<std::int64_t>(bin)) {
        EXPECT_GE(parts[draw], reached - 1e-5) << "float32 sums of blocks";
        EXPECT_LE(parts[draw], after + 1e-5);
        ++draw;
      }
      reached = after;
    }
  }
  EXPECT_EQ(draw, count);
}

}  // namespace palpate::pose_histogram_test
