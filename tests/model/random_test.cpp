#include "model/random.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace palpate::random_test {

constexpr int draws = 1'000'000;

struct Moments {
  double mean;
  double variance;
};

Moments moments(const std::vector<double>& x) {
  Moments m{0.0, 0.0};
  for (const double value : x) {
    m.mean += value / static_cast<double>(x.size());
  }
  for (const double value : x) {
    m.variance += (value - m.mean) * (value - m.mean) / static_cast<double>(x.size());
  }
  return m;
}

TEST(Random, UniformHasTheMomentsOfTheUnitInterval) {
  Random random(1, Stream::sensor);
  std::vector<double> x(draws);
  std::generate(x.begin(), x.end(), [&] { return random.uniform(); });
  const Moments m = moments(x);
  // Five standard errors: sqrt(1/12 / n) of the mean, sqrt((1/80 - 1/144) / n) of the variance.
  EXPECT_NEAR(m.mean, 0.5, 5.0 * std::sqrt(1.0 / 12.0 / draws));
  EXPECT_NEAR(m.variance, 1.0 / 12.0, 5.0 * std::sqrt((1.0 / 80.0 - 1.0 / 144.0) / draws));
  EXPECT_GE(*std::min_element(x.begin(), x.end()), 0.0);
  EXPECT_LT(*std::max_element(x.begin(), x.end()), 1.0);
}

TEST(Random, NormalHasZeroMeanUnitVarianceAndGaussianTails) {
  Random random(2, Stream::sensor);
  std::vector<double> x(draws);
  std::generate(x.begin(), x.end(), [&] { return random.normal(); });
  const Moments m = moments(x);
  // Five standard errors: sqrt(1 / n) of the mean, sqrt(2 / n) of the variance.
  EXPECT_NEAR(m.mean, 0.0, 5.0 * std::sqrt(1.0 / draws));
  EXPECT_NEAR(m.variance, 1.0, 5.0 * std::sqrt(2.0 / draws));
  for (const double z : {-2.0, -1.0, 0.0, 1.0, 2.0}) {
    const double below =
        static_cast<double>(std::count_if(x.begin(), x.end(), [z](double v) { return v < z; })) /
        draws;
    const double p = std::erfc(-z / std::sqrt(2.0)) / 2.0;
    // Five standard errors of a binomial proportion.
    EXPECT_NEAR(below, p, 5.0 * std::sqrt(p * (1.0 - p) / draws)) << "z = " << z;
  }
}

TEST(Random, SuccessiveNormalsAreUncorrelated) {
  Random random(3, Stream::sensor);
  double sum = 0.0;
  double previous = random.normal();
  for (int i = 0; i < draws; ++i) {
    const double next = random.normal();
    sum += previous * next;
    previous = next;
  }
  // Five standard errors: products of independent standard normals have unit variance.
  EXPECT_NEAR(sum / draws, 0.0, 5.0 / std::sqrt(draws));
}

TEST(Random, EngineIsTheSameOnEveryStandardLibrary) {
  // Computed apart from this program, from the definitions of seed_seq and MT19937-64.
  Random random(42, Stream::touch_poses);
  EXPECT_EQ(random.uniform(), 0x1.95707a74cb2e0p-5);
  EXPECT_EQ(random.uniform(), 0x1.ee21ab0dd47b4p-2);
}

TEST(Random, StreamsAndSeedsDiffer) {
  const double reference = Random(5, Stream::sensor).uniform();
  EXPECT_EQ(Random(5, Stream::sensor).uniform(), reference);
  EXPECT_NE(Random(5, Stream::touch_poses).uniform(), reference);
  EXPECT_NE(Random(5, Stream::object_pose).uniform(), reference);
  EXPECT_NE(Random(6, Stream::sensor).uniform(), reference);
  // Seeds that differ in the upper half only.
  EXPECT_NE(Random(5 + (std::uint64_t{1} << 32), Stream::sensor).uniform(), reference);
}

}  // namespace palpate::random_test
