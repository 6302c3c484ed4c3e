// What passes the least limits that Vulkan promises: 65,536 texels in a table. The results are
// those of the same device with its own limits, and of float64.

#include <vector>

#include <gtest/gtest.h>

#include "estimation/particles/parzen_mode.hpp"
#include "lattice/touch_by_touch_data.hpp"
#include "palpate/particle_filter.hpp"
#include "palpate/pose_histogram.hpp"
#include "particles/weighed_particles.hpp"
#include "support/least_limits.hpp"
#include "support/synthetic.hpp"

namespace palpate::least_limits_test {

/// @param part of the texels and of the workgroups that Vulkan promises
Device least_device(std::uint32_t part = 1) {
  Device device = Device::open();
  gpu::Limits limits = gpu::least_limits(device.context().limits());
  limits.table_texels /= part;
  for (std::uint32_t& count : limits.group_count) {
    count /= part;
  }
  device.context().lower_limits(limits);
  return device;
}

class LeastLimits : public testing::Test {
 protected:
  Device device = Device::open();
  Device least = least_device();
};

TEST_F(LeastLimits, TakeMoreParticlesThanATableHolds) {
  const std::vector<Hypothesis> objects = three_objects();
  const Recording recording = random_recording(2, 12, 191);
  for (const Resampling resampling : {Resampling::systematic, Resampling::multinomial}) {
    const ParticleOptions options{
        .particles = 70'000, .region = {}, .resampling = resampling, .seed = 2};
    ParticleFilter filter(least, objects, options);
    filter.update(all_touches(recording));
    EXPECT_LT(weight_error(filter, recording.touch(1), objects, options, 101), per_touch);
    ParticleFilter other(device, objects, options);
    other.update(all_touches(recording));
    EXPECT_EQ(weights_of(filter), weights_of(other));
  }
}

TEST_F(LeastLimits, FindTheModeOfMoreParticlesThanATableHolds) {
  constexpr std::size_t n = 70'000;
  const std::vector<shaders::Particle> particles(n, {.object = 1, .x_mm = 1.5F, .y_mm = -2.0F});
  const std::vector<double> weights(n, 1.0 / n);
  gpu::CommandStream stream(least.context());
  const ParzenMaximum maximum = ParzenMode(least.context(), stream, n).find(particles, weights);
  EXPECT_EQ(maximum.x_mm, 1.5);
  EXPECT_EQ(maximum.y_mm, -2.0);
  EXPECT_NEAR(maximum.density, 1.0, 1e-9) << "float64 rounding";
}

TEST_F(LeastLimits, TakeParticlesOnMapsOfMoreCellsThanATableHolds) {
  // Two of different cells, neither of which fills a table.
  const std::vector<Hypothesis> objects{{random_map(200, 210, 0.1, 4.0, 192), 1.0},
                                        {random_map(210, 190, 0.09, 4.0, 193), 1.0}};
  const ParticleOptions options{.particles = 1000, .region = {}};
  const Recording recording = random_recording(2, 36, 194);
  ParticleFilter filter(least, objects, options);
  filter.update(all_touches(recording));
  EXPECT_LT(weight_error(filter, recording.touch(1), objects, options), per_touch);
  ParticleFilter other(device, objects, options);
  other.update(all_touches(recording));
  EXPECT_EQ(weights_of(filter), weights_of(other)) << "the same numbers, read in another way";
  EXPECT_LT(filter.device_bytes(), other.device_bytes() + 1);
}

struct LongAxis {
  const char* name;
  int x;
  int theta;
  DisplacementSd sd;
  std::size_t touches;
};

class LeastLimitsOf : public LeastLimits, public testing::WithParamInterface<LongAxis> {};

TEST_P(LeastLimitsOf, BlurAsTheDeviceDoes) {
  // The limits are a tenth of the least, so that a tenth of the bins passes them. There are four
  // objects: at 1,700 thetas their planes are more than a table's texels and a dispatch's
  // workgroups.
  Device tenth = least_device(10);
  std::vector<Hypothesis> objects = two_maps();
  objects.insert(objects.end(), two_maps().begin(), two_maps().end());
  const Recording recording = random_recording(GetParam().touches, 8, 195);
  const std::vector<Touch> touches = all_touches(recording);
  HistogramOptions options;
  options.lattice = {.x_mm = {-5.0, 6.0, GetParam().x},
                     .y_mm = {0.0, 0.0, 1},
                     .theta_rad = {0.0, two_pi, GetParam().theta}};
  options.none_weight = 1.0;
  options.touch_sd = options.slip_sd = GetParam().sd;
  PoseHistogram histogram(tenth, objects, options);
  histogram.update(touches);
  PoseHistogram other(device, objects, options);
  other.update(touches);
  for (const int object : {0, 3}) {
    // Both are within this of float64: a table of fewer elements makes other products of them.
    EXPECT_LT(largest_difference(histogram.log_likelihood(object), other.log_likelihood(object)),
              2 * per_touch);
  }
  EXPECT_NEAR(histogram.estimate().none, other.estimate().none, 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Lattices, LeastLimitsOf,
                         testing::Values(LongAxis{"ManyThetas", 1, 1700, {.rad = 9e-4}, 1},
                                         LongAxis{"FarAlongTheta", 1, 400, {.rad = 0.25}, 2},
                                         LongAxis{"ManyAlongX", 7000, 1, {.mm = 0.1}, 1}),
                         [](const auto& test) { return std::string(test.param.name); });

TEST_F(LeastLimits, BlurFarAlongThetaAsTheReferenceDoes) {
  const Recording recording = random_recording(1, 20, 196);
  const std::vector<Touch> touches = all_touches(recording);
  HistogramOptions options{
      .lattice = {.x_mm = {-5.0, 6.0, 2}, .y_mm = {0.0, 0.0, 1}, .theta_rad = {0.0, two_pi, 400}},
      .touch_sd = {.rad = 0.2}};
  options.contact.prior = 0.2;
  PoseHistogram histogram(least, two_maps(), options);
  histogram.update(touches);
  EXPECT_LT(likelihood_error(histogram, expected_posterior(options, touches)), per_mean);
}

}  // namespace palpate::least_limits_test
