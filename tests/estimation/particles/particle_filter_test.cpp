#include "palpate/particle_filter.hpp"

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>

#include <gtest/gtest.h>
#include <glm/vec3.hpp>

#include "beliefs.hpp"
#include "palpate/pose_error.hpp"
#include "support/synthetic.hpp"
#include "support/touched_shape.hpp"

namespace palpate::particle_filter_test {

Recording says_nothing() {
  Recording recording = random_recording(1, 36, 431);
  recording.valid.assign(36, 0);
  return recording;
}

TEST(ParticleFilter, StartsUniformByPriorWeightAndReturnsToIt) {
  const std::vector<Hypothesis> objects = three_objects();
  ParticleOptions options{.particles = 4000,
                          .region = {.x_mm = {-3.0, 5.0, 1},
                                     .y_mm = {10.0, 12.0, 1},
                                     .theta_rad = {1.0, 1.0 + std::numbers::pi, 1}}};
  ParticleFilter filter(shared_device(), objects, options);
  const ParticleFilter untouched(shared_device(), objects, options);
  const Recording recording = random_recording(2, 36, 432);
  for (const bool after_reset : {false, true}) {
    EXPECT_EQ(all_answers(filter), all_answers(untouched)) << after_reset;
    EXPECT_EQ(filter.effective_sample_size(), 4000.0);
    const std::vector<double> identity = filter.estimate().identity;
    EXPECT_NEAR(identity[0], 0.25, 1e-12) << "float64 sums";
    EXPECT_NEAR(identity[1], 0.5, 1e-12);
    glm::dvec3 sum{0.0};
    for (const auto& [object, pose, weight] : filter.particles()) {
      const glm::dvec3 place{pose.translation_mm, pose.theta_rad};
      for (int axis = 0; axis < 3; ++axis) {
        const Axis& range = axis == 0   ? options.region.x_mm
                            : axis == 1 ? options.region.y_mm
                                        : options.region.theta_rad;
        EXPECT_GE(place[axis], range.lower - 1e-6) << "float32 about the centre";
        EXPECT_LE(place[axis], range.upper + 1e-6);
        sum[axis] += (place[axis] - range.lower) / (range.upper - range.lower) / 4000.0;
      }
      EXPECT_NEAR(weight, 1.0 / 4000.0, 1e-15);
    }
    for (int axis = 0; axis < 3; ++axis) {
      // Five deviations of the mean of 4,000 uniform numbers.
      EXPECT_NEAR(sum[axis], 0.5, 5.0 * std::sqrt(1.0 / 12.0 / 4000.0));
    }
    filter.update(all_touches(recording));
    EXPECT_NE(all_answers(filter), all_answers(untouched));
    filter.reset();
  }
}

TEST(ParticleFilter, MovesByNormalNoiseOfTheGivenDeviations) {
  constexpr int n = 200'000;
  ParticleOptions options{
      .particles = n,
      .region = {.x_mm = {2.0, 2.0, 1}, .y_mm = {0.0, 0.0, 1}, .theta_rad = {3.0, 3.0, 1}}};
  options.motion_mm = 1.5;
  options.motion_rad = 0.2;
  ParticleFilter filter(shared_device(), three_objects(), options);
  const Recording nothing = says_nothing();
  filter.update(nothing.touch(0));
  // Moments 1 to 4 of three standard normal numbers, and their products.
  std::array<std::array<double, 4>, 3> moment{};
  glm::dvec3 product{0.0};
  int beyond = 0;
  for (const auto& [object, pose, weight] : filter.particles()) {
    const glm::dvec3 z{(pose.translation_mm.x - 2.0) / 1.5, pose.translation_mm.y / 1.5,
                       wrap_angle(pose.theta_rad - 3.0, two_pi) / 0.2};
    for (int axis = 0; axis < 3; ++axis) {
      for (int power = 1; power <= 4; ++power) {
        moment[axis][power - 1] += std::pow(z[axis], power) / n;
      }
      beyond += std::abs(z[axis]) > 3.0 ? 1 : 0;
    }
    product += glm::dvec3{z.x * z.y, z.y * z.z, z.z * z.x} / static_cast<double>(n);
  }
  // Five deviations of each moment's mean: the variance of z^k is E z^2k - (E z^k)^2.
  const double unit = 5.0 / std::sqrt(n);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(moment[axis][0], 0.0, unit);
    EXPECT_NEAR(moment[axis][1], 1.0, unit * std::sqrt(2.0));
    EXPECT_NEAR(moment[axis][2], 0.0, unit * std::sqrt(15.0));
    EXPECT_NEAR(moment[axis][3], 3.0, unit * std::sqrt(96.0));
    EXPECT_NEAR(product[axis], 0.0, unit);
  }
  // 0.0027 of them lie beyond three deviations.
  const double expected = 0.0026998 * 3 * n;
  EXPECT_NEAR(beyond, expected, 5.0 * std::sqrt(expected));

  // Two steps have twice the variance, so the second is independent of the first.
  filter.update(nothing.touch(0));
  double square = 0.0;
  for (const auto& particle : filter.particles()) {
    square += std::pow(particle.T_object_robot.translation_mm.y / 1.5, 2) / n;
  }
  EXPECT_NEAR(square, 2.0, 2.0 * unit * std::sqrt(2.0));
}

TEST(ParticleFilter, ATouchThatSaysNothingMovesButWeighsNothing) {
  ParticleFilter filter(shared_device(), three_objects(), {.particles = 1000, .region = {}});
  const Recording recording = random_recording(1, 36, 437);
  const Recording nothing = says_nothing();
  for (const bool touched : {false, true}) {
    filter.update(touched ? recording.touch(0) : nothing.touch(0));
    const auto before = filter.particles();
    const double effective = filter.effective_sample_size();
    filter.update(nothing.touch(0));
    const auto after = filter.particles();
    for (std::size_t i = 0; i < before.size(); ++i) {
      EXPECT_EQ(after[i].weight, before[i].weight);
      EXPECT_EQ(after[i].object, before[i].object);
      EXPECT_NE(after[i].T_object_robot.theta_rad, before[i].T_object_robot.theta_rad);
    }
    EXPECT_EQ(filter.effective_sample_size(), effective);
  }
}

TEST(ParticleFilter, TheSeedDecidesEveryBit) {
  ParticleOptions options{.particles = 3000, .region = {}, .seed = 0x1234'5678'9ABC};
  ParticleFilter first(shared_device(), three_objects(), options);
  ParticleFilter second(shared_device(), three_objects(), options);
  options.seed += std::uint64_t{1} << 32;
  const ParticleFilter other(shared_device(), three_objects(), options);
  EXPECT_NE(all_answers(first), all_answers(other)) << "the upper half of the seed counts";
  const Recording recording = random_recording(4, 36, 438);
  first.update(all_touches(recording));
  second.update(all_touches(recording));
  EXPECT_EQ(all_answers(first), all_answers(second));
}

TEST(ParticleFilter, MemoryCountsWhatAnEstimateTakes) {
  constexpr int particles = 10'000;
  ParticleFilter filter(shared_device(), three_objects(), {.particles = particles, .seed = 5});
  const std::uint64_t before = filter.device_bytes();
  filter.estimate();
  // All weigh the same, so that the estimate takes every particle, four floats each.
  EXPECT_GE(filter.device_bytes(), before + particles * 4 * sizeof(float));
}

std::vector<Hypothesis> letter_and_disc() {
  return {{map_of(on_letter_l, "L"), 1.0}, {map_of(on_disc, "disc"), 1.0}};
}

TEST(ParticleFilter, RandomParticlesFindAnObjectThatWasTakenElsewhere) {
  const std::vector<Hypothesis> objects = letter_and_disc();
  const Body body = body_of(objects[0].map);
  const Pose first{{-6.0, -6.0}, 0.5};
  const Pose second{{7.0, 5.0}, 3.6};
  const Recording before = touches_of(on_letter_l, first, 8, 463);
  const Recording after = touches_of(on_letter_l, second, 25, 464);
  for (const bool augmented : {false, true}) {
    ParticleOptions options{.particles = 5000, .region = {}};
    options.augmented = augmented;
    ParticleFilter filter(shared_device(), objects, options);
    const auto error_mm = [&](const Pose& truth) {
      return pose_error_mm(body, 1, filter.estimate().mode.T_object_robot, truth);
    };
    filter.update(all_touches(before));
    EXPECT_LT(error_mm(first), 2.0);
    filter.update(all_touches(after));
    if (augmented) {
      EXPECT_LT(error_mm(second), 2.0);
    } else {
      EXPECT_GT(error_mm(second), 4.0) << "or there was nothing to recover from";
    }
  }
}

/// How often every particle was drawn, and what the law expects: without motion a particle keeps
/// its ancestor's pose.
struct Draw {
  std::vector<double> expected;
  std::vector<int> copies;
};

/// Draws n particles once from weights that one touch gave. `elements` decides how uneven they are.
Draw draw_once(Resampling resampling, int n, std::size_t elements, std::uint64_t seed) {
  const Recording recording = random_recording(2, elements, 451);
  ParticleFilter filter(shared_device(), two_objects(4.0, 81),
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

}  // namespace palpate::particle_filter_test
