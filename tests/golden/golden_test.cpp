// Numbers of every equation that another program computed in float64, to ten digits: a wrong change
// of the product and of the reference alike fails here.

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/map_builder.hpp"
#include "palpate/particle_filter.hpp"
#include "palpate/pose_error.hpp"
#include "palpate/pose_histogram.hpp"
#include "reference/reference.hpp"
#include "support/shared_device.hpp"
#include "support/synthetic.hpp"

namespace palpate::golden_test {

constexpr double digits = 1e-9;         // the numbers have ten digits
constexpr double float32_maps = 1e-6;   // what a log-likelihood loses where a map holds float32
constexpr double map_tolerance = 1e-3;  // error allowed for a map's cell, in nats
constexpr double prior = 0.25;
constexpr Reading in = Reading::in_contact;
constexpr Reading no = Reading::no_contact;
constexpr Reading unknown = Reading::unknown;

/// Objects a and b; b has twice the weight of a.
const std::vector<Hypothesis>& objects() {
  static const std::vector<Hypothesis> two{
      {{.label = "a",
        .cell_mm = 0.8,
        .origin_mm = {-1.6, -0.8},
        .prior = prior,
        .nx = 4,
        .ny = 3,
        .log_odds = {-1.2F, 0.4F, 2.5F, -3.0F, 0.7F, 1.9F, -0.6F, 0.2F, -2.2F, 3.1F, 0.9F, -1.4F}},
       1.0},
      {{.label = "b",
        .cell_mm = 1.1,
        .origin_mm = {-1.1, -2.2},
        .prior = prior,
        .nx = 3,
        .ny = 4,
        .log_odds = {2.0F, -0.5F, 1.3F, -1.7F, 0.8F, -2.4F, 0.3F, -0.9F, 1.6F, 1.1F, 2.7F, -3.3F}},
       2.0}};
  return two;
}

/// Two touches of six elements; one pressure of the first touch equals the threshold.
Recording two_touches() {
  Recording recording;
  recording.elements_mm = {{-2.0, 0.5}, {-0.7, -0.4}, {0.0, 0.9},
                           {0.8, 0.1},  {1.9, -1.0},  {0.4, -1.6}};
  recording.T_robot_sensor = {{{0.3, -0.2}, 0.4}, {{-0.5, 0.35}, -1.1}};
  recording.pressure = {0.9, 5.5, 8.0, 2.0, 1.1, 3.0, 6.0, 0.2, 2.4, 1.0, 7.5, 1.8};
  return recording;
}

TEST(GoldenValues, OfTheContactClassifier) {
  const Recording recording = two_touches();
  const std::vector<std::vector<Reading>> expected{{no, in, in, unknown, no, in},
                                                   {in, no, in, no, in, no}};
  for (const std::size_t touch : {0U, 1U}) {
    EXPECT_EQ(ContactClassifier{}.classify(recording.touch(touch)), expected[touch]);
    EXPECT_EQ(reference::classify(recording.touch(touch), ContactClassifier{}), expected[touch]);
  }
}

TEST(GoldenValues, OfTheInverseSensorModel) {
  constexpr double distances_mm[] = {0.0, 0.3, 1.7};
  struct Row {
    double peak, prior;
    Reading reading;
    double nats[3];  // at the distances
  };
  for (const auto& [peak, m, reading, nats] :
       {Row{0.8, 0.25, in, {2.833213344, 2.36135647, 0.05699370597}},
        Row{0.8, 0.25, no, {-1.84582669, -1.435507254, -0.01936107467}},
        Row{0.9, 0.04, in, {5.420534999, 4.579904034, 0.3458099346}},
        Row{0.9, 0.04, no, {-2.339399066, -1.613637719, -0.01706743592}}}) {
    const InverseSensorModel sensor{.spread_mm = 0.6, .peak = peak, .prior = m};
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(sensor.increment(reading, distances_mm[k]), nats[k], digits);
      EXPECT_NEAR(reference::increment(reading, distances_mm[k], sensor), nats[k], digits);
    }
  }
  EXPECT_EQ(reference::increment(unknown, 0.3, {}), 0.0);
}

TEST(GoldenValues, OfTheLikelihood) {
  constexpr double log_odds[] = {-3.0, 0.5, 7.0};
  struct Row {
    double gamma;
    Reading reading;
    double nats[3];  // at the log odds
  };
  for (const auto& [gamma, reading, nats] :
       {Row{0.15, in, {-2.553459718, -0.5681185793, -0.1202196946}},
        Row{0.15, no, {-0.1658326399, -1.0260789, -3.262974183}},
        Row{0.0, in, {-3.048587352, -0.4740769842, -0.0009114664538}},
        Row{0.0, no, {-0.04858735157, -0.9740769842, -7.000911466}}}) {
    const ContactModel model{.gamma = gamma, .prior = prior};
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(model.log_likelihood(reading, {log_odds[k]}), nats[k], digits);
      EXPECT_NEAR(reference::log_likelihood(reading, {log_odds[k]}, model), nats[k], digits);
    }
  }
  EXPECT_EQ(reference::log_likelihood(unknown, {2.0}, ContactModel{}), 0.0);
}

TEST(GoldenValues, OfAMap) {
  const Recording recording = two_touches();
  const std::vector<Touch> touches = all_touches(recording);
  const MapOptions wanted{.cell_mm = 0.5, .sensor = {.prior = prior}};
  MapBuilder builder(shared_device(), wanted);
  builder.add(touches);
  const OccupancyGrid map = builder.build("golden");
  const std::vector<double> expected =
      reference::log_odds_map(touches, map, wanted.classifier, wanted.sensor);
  struct Cell {
    glm::dvec2 at_mm;
    double log_odds;
  };
  for (const auto& [at_mm, log_odds] :
       {Cell{{0.0, 0.0}, 0.1763145528}, Cell{{0.5, -0.5}, -0.5117576034},
        Cell{{-1.0, 0.5}, -2.040433441}, Cell{{1.0, 1.0}, 0.1839702588},
        Cell{{1.5, -1.0}, 0.365499858}}) {
    const int i = static_cast<int>(std::lround((at_mm.x - map.origin_mm.x) / map.cell_mm));
    const int j = static_cast<int>(std::lround((at_mm.y - map.origin_mm.y) / map.cell_mm));
    EXPECT_NEAR(map.at(i, j), log_odds, map_tolerance);
    EXPECT_NEAR(expected[static_cast<std::size_t>(j) * map.nx + i], log_odds, digits);
  }
}

TEST(GoldenValues, OfTheHistogramFilter) {
  constexpr std::size_t bins[] = {0, 5, 11, 16, 23};
  constexpr double log_likelihood[2][5] = {
      {-9.083368813, -14.49486755, -9.341436846, -11.25736094, -8.399947675},
      {-9.965924152, -9.026854481, -8.458265976, -11.06022232, -7.657319003}};
  // "None of these": the log of the product of the touches' mean likelihoods, -3.890263443 and
  // -5.125688337 nats. At every bin the array overlaps both objects, so that the share is 1.
  constexpr double none_log_evidence = -9.01595178;
  constexpr double identity[] = {0.244942059, 0.5634555065};
  constexpr double none = 0.1916024346;
  const std::vector<double> xy[] = {
      {0.06831091637, 0.055160227, 0.01874962027, 0.04333685476, 0.02837270665, 0.03101173393},
      {0.08079095938, 0.1839936706, 0.01383326467, 0.09129867783, 0.03187735201, 0.161661582}};
  const std::vector<double> theta[] = {{0.05718158206, 0.06157249194, 0.04861849296, 0.07756949202},
                                       {0.09363329598, 0.1284885382, 0.1748760836, 0.1664575886}};
  // Two touches with the error of a log-likelihood change a probability by at most this.
  constexpr double probability = 4 * per_touch;

  const Recording recording = two_touches();
  const std::vector<Touch> touches = all_touches(recording);
  const HistogramOptions options{.lattice = {.x_mm = {-1.5, 1.5, 3},
                                             .y_mm = {-1.0, 2.0, 2},
                                             .theta_rad = {0.2, 6.2, 4},
                                             .pivot_mm = {0.5, -0.25}},
                                 .contact = {.gamma = 0.15, .prior = prior},
                                 .none_weight = 0.7};
  PoseHistogram histogram(shared_device(), objects(), options);
  histogram.update(touches);
  const reference::Posterior posterior = reference_posterior(objects(), options, touches);
  std::vector<std::vector<std::vector<double>>> by_touch;
  for (const std::size_t touch : {0U, 1U}) {
    by_touch.push_back(reference_posterior(objects(), options, std::span(touches).subspan(touch, 1))
                           .log_likelihood);
  }
  EXPECT_NEAR(reference::none_log_evidence(touches, options.lattice, objects(), by_touch),
              none_log_evidence, float32_maps);

  const Estimate estimate = histogram.estimate();
  EXPECT_NEAR(estimate.none, none, probability);
  EXPECT_EQ(estimate.mode.object, 1);
  EXPECT_EQ(estimate.mode.bin, 13);
  EXPECT_NEAR(estimate.mode.log_likelihood, -7.56164965, 2 * per_touch);
  EXPECT_EQ(reference::mode(posterior).object, 1);
  EXPECT_EQ(reference::mode(posterior).bin, 13);
  for (const int object : {0, 1}) {
    SCOPED_TRACE(objects()[object].map.label);
    const std::vector<double> logs = histogram.log_likelihood(object);
    for (std::size_t k = 0; k < 5; ++k) {
      EXPECT_NEAR(logs[bins[k]], log_likelihood[object][k], 2 * per_touch);
      EXPECT_NEAR(posterior.log_likelihood[object][bins[k]], log_likelihood[object][k],
                  float32_maps);
    }
    EXPECT_NEAR(estimate.identity[object], identity[object], probability);
    EXPECT_NEAR(reference::identity(posterior)[object] * (1.0 - none), identity[object],
                float32_maps);
    const auto expect_marginal = [&](const std::vector<double>& product,
                                     const std::vector<double>& of_reference,
                                     const std::vector<double>& expected) {
      for (std::size_t k = 0; k < expected.size(); ++k) {
        EXPECT_NEAR(product[k], expected[k], probability);
        EXPECT_NEAR(of_reference[k] * (1.0 - none), expected[k], float32_maps);
      }
    };
    const Marginals marginals = histogram.marginals(object);
    expect_marginal(marginals.xy, reference::marginal_xy(posterior, object), xy[object]);
    expect_marginal(marginals.theta, reference::marginal_theta(posterior, object), theta[object]);
  }
}

TEST(GoldenValues, OfWeightsAndTheParzenDensity) {
  const double logs[] = {-1.2, -3.4, 0.7};
  const double weights[] = {0.1282594313, 0.01421155007, 0.8575290187};
  const std::vector<double> weighed = reference::importance_weights(logs);
  for (const int i : {0, 1, 2}) {
    EXPECT_NEAR(weighed[i], weights[i], digits);
  }
  // The first two lie on either side of half a turn.
  const std::vector<reference::Particle> particles{
      {0, {{0.1, -0.2}, 3.0}, 0.5}, {0, {{0.3, 0.1}, -3.1}, 0.3}, {1, {{0.6, 0.0}, 0.5}, 0.2}};
  EXPECT_EQ(reference::identity(particles, 3), (std::vector<double>{0.8, 0.2, 0.0}));
  EXPECT_NEAR(reference::cone(particles[0].pose, particles[1].pose), 0.5955783676, digits);
  EXPECT_NEAR(reference::parzen(particles, 0, {{0.5, 0.0}, std::numbers::pi}), 0.4972207174,
              digits);
  EXPECT_NEAR(reference::parzen(particles, 1, {{0.5, 0.0}, 0.16 * std::numbers::pi}), 0.1799929531,
              digits);
  EXPECT_NEAR(reference::largest_parzen(particles, 2, 2.0), 0.580592629, digits);
}

TEST(GoldenValues, OfParticlesAtOnePose) {
  // All particles have one pose, which no noise moves; a third of them are of the first object.
  const ParticleOptions wanted{
      .particles = 3000,
      .region = {.x_mm = {0.1, 0.1, 1}, .y_mm = {0.2, 0.2, 1}, .theta_rad = {0.7, 0.7, 1}},
      .contact = {.gamma = 0.15, .prior = prior},
      .motion_mm = 0.0,
      .motion_rad = 0.0};
  const Recording recording = two_touches();
  ParticleFilter filter(shared_device(), objects(), wanted);
  filter.update(recording.touch(0));
  const std::vector<double> identity = filter.estimate().identity;
  EXPECT_NEAR(identity[0], 0.262529213, 2 * per_touch);
  EXPECT_NEAR(identity[1], 0.737470787, 2 * per_touch);
  EXPECT_NEAR(filter.effective_sample_size() / 2933.814593, 1.0, 4 * per_touch);
  const double logs[] = {-3.72808242, -3.388365487};
  for (const std::size_t object : {0U, 1U}) {
    EXPECT_NEAR(reference::log_likelihood(recording.touch(0), {{0.1, 0.2}, 0.7},
                                          objects()[object].map, wanted.contact),
                logs[object], float32_maps);
  }
}

TEST(GoldenValues, OfThePoseError) {
  OccupancyGrid map = objects()[0].map;
  const Body body = body_of(map);
  const Body plain = reference::body_of(map);
  EXPECT_NEAR(body.inertia_mm2, 0.8881632653, digits);
  EXPECT_NEAR(body.centroid_mm.x, -0.4571428571, digits);
  EXPECT_NEAR(body.centroid_mm.y, 0.0, digits);
  EXPECT_NEAR(plain.inertia_mm2, body.inertia_mm2, digits);
  EXPECT_NEAR(plain.centroid_mm.x, body.centroid_mm.x, digits);
  const Pose estimate{{0.5, -0.3}, 2.9};
  const Pose truth{{-0.2, 0.4}, -0.5};
  for (const auto& [symmetry, error_mm] : {std::pair(1, 2.175934927), std::pair(2, 1.140172902),
                                           std::pair(3, 1.328743313), std::pair(0, 1.114009423)}) {
    EXPECT_NEAR(pose_error_mm(body, symmetry, estimate, truth), error_mm, digits);
    map.symmetry = symmetry;
    EXPECT_NEAR(reference::pose_error_mm(map, estimate, truth), error_mm, digits);
  }
}

}  // namespace palpate::golden_test
