#include <cmath>
#include <map>
#include <tuple>

#include <gtest/gtest.h>

#include "palpate/particle_filter.hpp"
#include "support/synthetic.hpp"

namespace palpate::particle_drawing_test {

/// How often every particle was drawn, and what the law expects: without motion a particle keeps
/// its ancestor's pose.
struct Draw {
  std::vector<double> expected;
  std::vector<int> copies;
};

/// Draws n particles once from weights that one touch gave. `elements` decides how uneven they are.
Draw draw_once(Resampling resampling, int n, std::size_t elements, std::uint64_t seed) {
  const Recording recording = random_recording(2, elements, 451);
  Device device = Device::open();
  ParticleFilter filter(device, two_objects(4.0, 81),
                        {.particles = n,
                         .region = {},
                         .motion_mm = 0.0,
                         .motion_rad = 0.0,
                         .resampling = resampling,
                         .seed = seed});
  filter.update(recording.touch(0));

  using Place = std::tuple<int, double, double, double>;
  const auto place_of = [](const ParticleFilter::Particle& particle) -> Place {
    const Pose& pose = particle.T_object_robot;
    return {particle.object, pose.translation_mm.x, pose.translation_mm.y, pose.theta_rad};
  };
  Draw draw;
  std::map<Place, std::size_t> index;
  for (const ParticleFilter::Particle& particle : filter.particles()) {
    index.emplace(place_of(particle), draw.expected.size());
    draw.expected.push_back(n * particle.weight);
  }
  EXPECT_EQ(index.size(), static_cast<std::size_t>(n)) << "poses are told apart";
  draw.copies.resize(draw.expected.size());
  filter.update(recording.touch(1));
  for (const ParticleFilter::Particle& particle : filter.particles()) {
    ++draw.copies[index.at(place_of(particle))];
  }
  return draw;
}

/// (chi^2 - k) / sqrt(2 k) over groups of neighbours that expect at least ten draws.
double chi_square_deviations(const Draw& draw) {
  double chi_square = 0.0;
  int groups = 0;
  double expected = 0.0;
  double drawn = 0.0;
  for (std::size_t i = 0; i < draw.expected.size(); ++i) {
    expected += draw.expected[i];
    drawn += draw.copies[i];
    if (expected >= 10.0) {
      chi_square += (drawn - expected) * (drawn - expected) / expected;
      ++groups;
      expected = 0.0;
      drawn = 0.0;
    }
  }
  return (chi_square - groups) / std::sqrt(2.0 * groups);
}

TEST(ParticleDrawing, MultinomialFollowsTheWeights) {
  for (const std::size_t elements : {2U, 36U}) {
    for (const std::uint64_t seed : {1U, 2U}) {
      const Draw draw = draw_once(Resampling::multinomial, 30'000, elements, seed);
      // Five deviations either way: neither too far from the law nor too near for chance.
      EXPECT_LT(std::abs(chi_square_deviations(draw)), 5.0) << elements << ", seed " << seed;
    }
  }
}

TEST(ParticleDrawing, SystematicTakesEveryParticleAsOftenAsItsWeightSays) {
  for (const int n : {1, 65, 1024, 30'000}) {
    for (const std::size_t elements : {2U, 36U}) {
      const Draw draw = draw_once(Resampling::systematic, n, elements, 1);
      for (std::size_t i = 0; i < draw.copies.size(); ++i) {
        // Float32 sums of a block's 1,024 weights place a particle to 1e-6 of what the block draws,
        // at most n.
        const double rounding = 1e-6 * n;
        ASSERT_GE(draw.copies[i], std::floor(draw.expected[i] - rounding)) << i << " of " << n;
        ASSERT_LE(draw.copies[i], std::ceil(draw.expected[i] + rounding)) << i << " of " << n;
      }
    }
  }
}

}  // namespace palpate::particle_drawing_test
