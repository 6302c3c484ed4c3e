#include "estimation/particles/parzen_mode.hpp"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "beliefs.hpp"
#include "support/least_limits.hpp"

namespace palpate::parzen_mode_test {

struct Cloud {
  std::vector<shaders::Particle> particles;
  std::vector<double> weights;
};

/// Particles spread over [-extent, extent] mm and rad (at most pi), of random weights that sum
/// to 1.
Cloud random_cloud(std::size_t n, std::uint32_t objects, double extent, std::uint64_t seed) {
  Uniform random(seed);
  Cloud cloud;
  double total = 0.0;
  const double most_rad = std::min(extent, std::numbers::pi);
  for (std::size_t i = 0; i < n; ++i) {
    cloud.particles.push_back({.object = static_cast<std::uint32_t>(random(0.0, objects)),
                               .x_mm = static_cast<float>(random(-extent, extent)),
                               .y_mm = static_cast<float>(random(-extent, extent)),
                               .theta_rad = static_cast<float>(random(-most_rad, most_rad))});
    cloud.weights.push_back(std::exp(random(-3.0, 0.0)));
    total += cloud.weights.back();
  }
  for (double& weight : cloud.weights) {
    weight /= total;
  }
  return cloud;
}

std::vector<reference::Particle> reference_particles(const Cloud& cloud) {
  std::vector<reference::Particle> particles;
  for (std::size_t i = 0; i < cloud.particles.size(); ++i) {
    const auto& [object, x, y, theta] = cloud.particles[i];
    particles.push_back({static_cast<int>(object), {{x, y}, theta}, cloud.weights[i]});
  }
  return particles;
}

/// The largest density over all of the grid that a particle within `extent` reaches.
double largest_density(const Cloud& cloud, int objects, double extent) {
  return reference::largest_parzen(reference_particles(cloud), objects, extent + 2.0);
}

ParzenMaximum find(const Cloud& cloud, Device device = Device::open()) {
  gpu::CommandStream stream(device.context());
  ParzenMode mode(device.context(), stream, cloud.particles.size());
  return mode.find(cloud.particles, cloud.weights);
}

void expect_on_grid(double value, double step) {
  EXPECT_NEAR(value / step, std::round(value / step), 1e-9) << "float64 rounding";
}

TEST(ParzenMode, IsThePlainMaximumOverTheGrid) {
  // Dense, so that one tile takes several units' worth of lists, and sparse.
  for (const auto& [n, extent] :
       {std::pair{std::size_t{1}, 2.0}, std::pair{std::size_t{7}, 1.0},
        std::pair{std::size_t{65}, 4.0}, std::pair{std::size_t{300}, 2.0}}) {
    for (const std::uint64_t seed : {421U, 422U, 423U}) {
      const Cloud cloud = random_cloud(n, 2, extent, seed);
      const ParzenMaximum maximum = find(cloud);
      const double expected = largest_density(cloud, 2, extent);
      // Points are compared by float32 sums of so many terms; the answer's density is in float64,
      // of weights that were rounded to float32.
      EXPECT_NEAR(maximum.density, expected, 1e-5 * expected) << n << ", seed " << seed;
      EXPECT_NEAR(reference::parzen(reference_particles(cloud), static_cast<int>(maximum.object),
                                    {{maximum.x_mm, maximum.y_mm}, maximum.theta_rad}),
                  maximum.density, 1e-6 * expected);
      expect_on_grid(maximum.x_mm, 0.5);
      expect_on_grid(maximum.y_mm, 0.5);
      expect_on_grid(maximum.theta_rad, 0.04 * std::numbers::pi);
    }
  }
}

TEST(ParzenMode, ReachesAcrossTheCutOfTheCircleAndBetweenTiles) {
  // Pairs that only a point between them sees both of, on either side of where tiles and turns
  // meet.
  const auto pi = static_cast<float>(std::numbers::pi);
  for (const auto& [x, y, theta] :
       {std::array{0.0F, 0.0F, pi}, std::array{2.0F, -2.0F, 0.0F}, std::array{-4.0F, 6.0F, 1.2566F},
        std::array{-0.5F, -0.5F, -1.2566F}}) {
    Cloud cloud;
    for (const float side : {-0.4F, 0.4F}) {
      float turned = theta + side;
      turned = turned >= pi ? turned - 2.0F * pi : turned;
      cloud.particles.push_back(
          {.object = 0, .x_mm = x + side, .y_mm = y + side, .theta_rad = turned});
      cloud.weights.push_back(0.5);
    }
    const ParzenMaximum maximum = find(cloud);
    const double expected = largest_density(cloud, 1, 8.0);
    EXPECT_NEAR(maximum.density, expected, 1e-5 * expected) << x << ", " << y << ", " << theta;
  }
}

TEST(ParzenMode, OfManyParticlesInOnePlaceIsTheirWeight) {
  // More than one unit takes, more than one loop may, and than a table of the least limits holds.
  constexpr std::size_t n = 100'000;
  const Cloud cloud{std::vector<shaders::Particle>(
                        n, {.object = 3, .x_mm = 1.5F, .y_mm = -2.0F, .theta_rad = 0.0F}),
                    std::vector<double>(n, 1.0 / n)};
  for (const bool least : {false, true}) {
    const ParzenMaximum maximum = find(cloud, lowered_device([&](gpu::Limits& limits) {
                                         limits = least ? gpu::least_limits(limits) : limits;
                                       }));
    EXPECT_EQ(maximum.object, 3U);
    EXPECT_EQ(maximum.x_mm, 1.5);
    EXPECT_EQ(maximum.y_mm, -2.0);
    EXPECT_EQ(maximum.theta_rad, 0.0);
    EXPECT_NEAR(maximum.density, 1.0, 1e-9) << "float64 rounding";
  }
}

}  // namespace palpate::parzen_mode_test
