// A table over layers of maps that were sensed in part, against the reference in float64.

#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "palpate/learned_sensor.hpp"
#include "palpate/particle_filter.hpp"
#include "palpate/pose_histogram.hpp"
#include "particles/weighed_particles.hpp"
#include "support/certified.hpp"
#include "support/synthetic.hpp"

namespace palpate::learned_layer_test {

/// A map of which patches were sensed, with counts and mean levels.
OccupancyGrid sensed_in_part(const std::string& label, int nx, int ny, double cell_mm,
                             std::uint64_t seed) {
  OccupancyGrid map = random_map(nx, ny, cell_mm, 12.0, seed);
  map.label = label;
  Uniform random(seed + 1);
  const glm::dvec2 middle(random(0.0, nx), random(0.0, ny));
  const double radius = random(2.0, 0.7 * nx);
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) {
      const bool sensed =
          std::hypot(i - middle.x, j - middle.y) < radius || random(0.0, 1.0) < 0.02;
      map.observations.push_back(sensed ? 2.0F : 0.0F);
      map.mean_level.push_back(sensed ? static_cast<float>(random(0.0, 25.0)) : 0.0F);
      if (!sensed) {
        map.log_odds[static_cast<std::size_t>(j) * nx + i] =
            static_cast<float>(map.prior_log_odds());
      }
    }
  }
  return map;
}

/// Numbers of so many levels that jump by some nats from node to node, as those of nodes with few
/// counts do.
std::vector<double> jagged(std::size_t levels, Uniform& random) {
  std::vector<double> numbers;
  for (std::size_t i = 0; i < levels * ReadingLayer::nodes; ++i) {
    numbers.push_back(random(-6.0, 0.0));
  }
  return numbers;
}

struct Learned {
  std::vector<Hypothesis> objects;
  ContactModel contact;
};

/// Four levels; the second of three objects has numbers of its own and may lie on either side.
Learned learned(MapLayer of, std::uint64_t seed) {
  Uniform random(seed);
  LearnedSensor sensor;
  sensor.table = LearnedTable{
      .layer = {.of = of, .near_mm = 1.5, .far_mm = 4.0, .unit_level = 0.5, .full_level = 20.0},
      .level_edges = {9.0, 14.0}};
  sensor.table->shared = jagged(sensor.table->levels(), random);
  sensor.table->objects["pen"] = jagged(sensor.table->levels(), random);
  Learned result{.objects = {{sensed_in_part("cup", 31, 27, 0.5, seed + 10), 1.0},
                             {sensed_in_part("pen", 23, 37, 0.4, seed + 20), 3.0},
                             {sensed_in_part("box", 12, 15, 1.0, seed + 30), 0.5}}};
  result.objects[1].map.mirror = true;
  add_mirror_images(result.objects);
  apply(sensor, result.objects, result.contact);
  return result;
}

PoseLattice lattice_of(double step_mm) {
  return {.x_mm = {-3.0, -3.0 + 11 * step_mm, 11},
          .y_mm = {-2.0, -2.0 + 9 * step_mm, 9},
          .theta_rad = {0.0, 3.0, 4}};
}

class LearnedLayer : public testing::TestWithParam<MapLayer> {
 protected:
  Device device_ = Device::open();
};

TEST_P(LearnedLayer, GivesTheReferenceByBins) {
  const Learned of = learned(GetParam(), 301);
  ASSERT_EQ(of.contact.table->sets(), 4u);
  const Recording moving = random_recording(3, 36, 303);
  // Register tiles over one and two cells, and runs of bins.
  for (const double step_mm : {0.1, 0.25, 0.8}) {
    SCOPED_TRACE(::testing::Message() << step_mm << " mm");
    const HistogramOptions options{.lattice = lattice_of(step_mm), .contact = of.contact};
    PoseHistogram histogram(device_, of.objects, options);
    histogram.update(all_touches(moving));
    EXPECT_LT(
        likelihood_error(histogram, reference_posterior(of.objects, options, all_touches(moving))),
        3 * per_touch);
  }
}

TEST_P(LearnedLayer, GivesTheReferenceByParticles) {
  const Learned of = learned(GetParam(), 311);
  const Recording recording = random_recording(1, 36, 312);
  const ParticleOptions options{.particles = 1000, .region = {}, .contact = of.contact};
  ParticleFilter filter(device_, of.objects, options);
  filter.update(recording.touch(0));
  EXPECT_LT(weight_error(filter, recording.touch(0), of.objects, options), per_touch);
}

TEST_P(LearnedLayer, KeepsTheCertificateOfBounds) {
  double dropped = 0.0;
  for (std::uint64_t seed = 321; seed < 327; ++seed) {
    SCOPED_TRACE(::testing::Message() << "scene " << seed);
    const Learned of = learned(GetParam(), 10 * seed);
    Uniform random(seed);
    const auto touches = static_cast<std::size_t>(random(1.0, 7.0));
    const Recording recording =
        random_recording(touches, static_cast<std::size_t>(random(1.0, 40.0)), seed);
    const double step_mm = std::array{0.1, 0.25, 0.8}[seed / 2 % 3];
    BoundedOptions options{.lattice = lattice_of(step_mm), .contact = of.contact};
    options.tolerance = seed % 2 == 0 ? 1e-6 : 1e-3;
    if (seed % 3 == 0) {
      options.evidence_nats = 0.1;
    }
    const Certified seen = expect_certified(of.objects, options, all_touches(recording), 1e-9);
    ASSERT_TRUE(seen.estimate.certificate);
    dropped = std::max(dropped, seen.estimate.certificate->dropped_mass);

    HistogramOptions dense{.lattice = options.lattice, .contact = of.contact};
    PoseHistogram histogram(device_, of.objects, dense);
    histogram.update(all_touches(recording));
    const std::vector<double> log_evidence = histogram.estimate().log_evidence;
    for (std::size_t i = 0; i < of.objects.size(); ++i) {
      const auto [low, high] = seen.estimate.certificate->log_evidence[i];
      const double rounding = per_touch * static_cast<double>(touches);
      // Both have the prior weights' share; see expect_certified() for float64.
      EXPECT_GE(log_evidence[i] - log_evidence[0],
                low - seen.estimate.certificate->log_evidence[0].high - 2 * rounding);
      EXPECT_LE(log_evidence[i] - log_evidence[0],
                high - seen.estimate.certificate->log_evidence[0].low + 2 * rounding);
    }
  }
  EXPECT_GT(dropped, 0.0) << "no scene left a bin out";
}

INSTANTIATE_TEST_SUITE_P(OfBoth, LearnedLayer,
                         testing::Values(MapLayer::log_odds, MapLayer::mean_level),
                         [](const auto& each) {
                           return each.param == MapLayer::log_odds ? "LogOdds" : "MeanLevel";
                         });

}  // namespace palpate::learned_layer_test
