// Hard touches, places and lattices of the posterior by bounds: its certificate and answers against
// float64 on all bins.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "bounded_case.hpp"

namespace palpate {
namespace {

TEST(BoundedHard, PivotsAndObjectsFarAway) {
  HardCase hard("bounds: pivots 1e5 mm away, with and without the touches",
                "elements are 2e5 cells from the pivot; a turn flings them off every map",
                "offsets are whole cells and a fraction; 1e-10 mm of places in float64");
  const std::vector<Hypothesis> objects = two_objects(6.0, 850);
  const Recording near = random_recording(4, 24, 851);
  for (const glm::dvec2 away_mm : {glm::dvec2(1e5, -1e5), glm::dvec2(0.0, 1e5)}) {
    BoundedOptions options = few_bins();
    options.lattice.pivot_mm = away_mm;
    // 1.5e-11 mm of 1e5 mm are 3e-11 cells of 12 nats, times 100 elements and turns.
    expect_certificate(hard, objects, options, moved(near, {away_mm, 0.0}), 1e-6);
    expect_certificate(hard, objects, options, near, 1e-6);  // far from the pivot: off the maps
  }
  // A fine lattice about the far pivot, at one theta.
  BoundedOptions options = few_bins();
  options.lattice = {.x_mm = {1e5 - 4.0, 1e5 + 4.0, 15},
                     .y_mm = {-1e5 - 3.0, -1e5 + 3.0, 12},
                     .theta_rad = {0.0, 0.0, 1}};
  expect_certificate(hard, objects, options, moved(near, {{-1e5, 1e5}, 0.0}), 1e-6);
}

TEST(BoundedHard, AnglesOfAMillionTurns) {
  HardCase hard("bounds: angles of 1e6 turns, of sensor and region",
                "offsets of elements from cosines of 6e6 rad", "1e-9 rad in float64");
  Recording recording = random_recording(4, 24, 852);
  for (std::size_t i = 0; i < recording.size(); ++i) {
    recording.T_robot_sensor[i].theta_rad += (i % 2 == 0 ? 1e6 : -1e6) * two_pi;
  }
  BoundedOptions options = few_bins();
  options.lattice.theta_rad = {1e6 * two_pi, 1e6 * two_pi + two_pi, 7};
  expect_certificate(hard, two_objects(6.0, 853), options, recording, 1e-6);
}

TEST(BoundedHard, FewBins) {
  HardCase hard("bounds: one bin, one theta, one row and one column",
                "tiles and vector lanes wider than the region",
                "lanes beyond the region are masked; all bins are evaluated");
  const std::vector<Hypothesis> objects = two_objects(6.0, 854);
  const Recording recording = random_recording(4, 24, 856);
  const Axis x{-5.0, 5.0, 9};
  const Axis theta{0.0, two_pi, 7};
  const Axis at{0.3, 0.3, 1};
  const Axis wide{-2.0, 2.0, 1};
  for (const PoseLattice& lattice : {PoseLattice{.x_mm = at, .y_mm = at, .theta_rad = at},
                                     PoseLattice{.x_mm = wide, .y_mm = wide, .theta_rad = wide},
                                     PoseLattice{.x_mm = x, .y_mm = x, .theta_rad = at},
                                     PoseLattice{.x_mm = x, .y_mm = at, .theta_rad = theta},
                                     PoseLattice{.x_mm = at, .y_mm = x, .theta_rad = theta},
                                     PoseLattice{.x_mm = at, .y_mm = at, .theta_rad = theta}}) {
    BoundedOptions options;
    options.lattice = lattice;
    expect_certificate(hard, objects, options, recording);
    options.contact.gamma = 0.0;
    const std::vector<Hypothesis> one{objects[0]};
    const Certified seen = expect_certificate(hard, one, options, recording);
    EXPECT_EQ(seen.estimate.identity, std::vector{1.0});
  }
}

TEST(BoundedHard, BinsWiderThanTheMap) {
  HardCase hard("bounds: bins of 44 mm over a map of 15 mm, and a region that misses the map",
                "nearly all bins see only the prior and are equal",
                "tiles off the map are exact: their mass is counted, not dropped");
  const std::vector<Hypothesis> objects = two_objects(6.0, 857);
  const Recording recording = random_recording(3, 24, 859);
  BoundedOptions options = few_bins();
  options.lattice.x_mm = {-200.0, 200.0, 9};
  options.lattice.y_mm = {-200.0, 190.0, 9};
  expect_certificate(hard, objects, options, recording);
  options.lattice.x_mm = {100.0, 140.0, 9};
  expect_certificate(hard, objects, options, recording);
}

TEST(BoundedHard, ElementsOnTheBoundariesOfCells) {
  HardCase hard("bounds: elements exactly on nodes and cell borders at every bin",
                "rounding puts an element into the neighbouring cell, beyond its window",
                "windows overlap by the node that a border shares");
  for (const double cell_mm : {0.5, 1.0, 0.1}) {  // 0.1 mm is no binary fraction
    const int cells = 41;
    std::vector<Hypothesis> objects{{random_map(cells, cells, cell_mm, 12.0, 860), 1.0},
                                    {random_map(cells, cells, cell_mm, 12.0, 861), 1.0}};
    for (const double shift : {0.0, 0.5}) {
      Recording recording;
      Uniform random(862);
      for (int e = 0; e < 20; ++e) {
        recording.elements_mm.emplace_back(cell_mm * (std::floor(random(-8.0, 8.0)) + shift),
                                           cell_mm * std::floor(random(-8.0, 8.0)));
      }
      for (int i = 0; i < 3; ++i) {
        recording.T_robot_sensor.push_back({{cell_mm * i, -cell_mm * i}, i * std::numbers::pi / 2});
        for (int e = 0; e < 20; ++e) {
          recording.pressure.push_back((e + i) % 3 == 0 ? 10.0 : 0.0);
        }
      }
      BoundedOptions options;
      // Centres at whole cells, and quarter turns.
      options.lattice = {.x_mm = {-8.5 * cell_mm, 8.5 * cell_mm, 17},
                         .y_mm = {-7.5 * cell_mm, 7.5 * cell_mm, 15},
                         .theta_rad = {-std::numbers::pi / 4, two_pi - std::numbers::pi / 4, 4}};
      expect_certificate(hard, objects, options, recording);
      options.lattice.theta_rad = {0.0, 0.0, 1};
      expect_certificate(hard, objects, options, recording);
    }
  }
}

TEST(BoundedHard, TouchesWithoutAKnownElement) {
  HardCase hard("bounds: touches without a known element, and none at all",
                "no penalty to add, no reading to have a table for", "nothing changes");
  const std::vector<Hypothesis> objects = two_objects(6.0, 867);
  Recording recording = random_recording(4, 12, 868);
  recording.valid.assign(4 * 12, 1);
  std::fill(recording.valid.begin(), recording.valid.begin() + 12, 0);
  std::fill(recording.valid.begin() + 24, recording.valid.begin() + 36, 0);
  expect_certificate(hard, objects, few_bins(), recording);
  std::fill(recording.valid.begin(), recording.valid.end(), 0);
  const Certified seen = expect_certificate(hard, objects, few_bins(), recording);
  EXPECT_EQ(seen.estimate.mode.log_likelihood, 0.0);
  EXPECT_EQ(seen.estimate.mode.object, 0);
}

TEST(BoundedHard, OneReadingAlone) {
  HardCase hard("bounds: touches of In Contact alone, and of No Contact alone",
                "a class that no touch has yet read has no penalties", "classes join as they come");
  const std::vector<Hypothesis> objects = two_objects(6.0, 869);
  Recording recording = random_recording(4, 12, 870);
  for (std::size_t i = 0; i < recording.pressure.size(); ++i) {
    recording.pressure[i] = i < 24 ? 10.0 : 0.0;
  }
  expect_certificate(hard, objects, few_bins(), recording);
}

TEST(BoundedHard, FourteenHundredElements) {
  HardCase hard("bounds: arrays of 1,400 elements, five touches",
                "the penalties of a fitting press, some 280 nats, saturate 16 bits",
                "sums widen to 32 bits in time; they never wrap");
  const std::vector<Hypothesis> objects{{random_map(61, 61, 0.5, 2.0, 871), 1.0},
                                        {random_map(31, 31, 1.0, 2.0, 872), 1.0}};
  Recording recording = random_recording(5, 1400, 873);
  for (Pose& pose : recording.T_robot_sensor) {
    pose.translation_mm *= 0.4;
  }
  BoundedOptions options;
  options.lattice = {.x_mm = {-5.0, 5.0, 5}, .y_mm = {-5.0, 5.0, 6}, .theta_rad = {0, two_pi, 3}};
  for (const double gamma : {0.1, 0.0}) {
    options.contact.gamma = gamma;
    expect_certificate(hard, objects, options, recording, 1e-8);
  }
  options.contact.gamma = 0.1;
  options.evidence_nats = 0.5;
  expect_certificate(hard, objects, options, recording, 1e-8);
}

TEST(BoundedHard, TouchesThatContradictEverything) {
  HardCase hard("bounds: gamma = 0 and touches that contradict every hypothesis",
                "every tile has a bound of exp(-36000), equal to every other one's",
                "logs throughout; `contradicted` says so");
  std::vector<Hypothesis> objects = two_objects(1.0, 874);
  objects[0].map.log_odds.assign(objects[0].map.log_odds.size(), -1000.0F);
  objects[1].map.log_odds.assign(objects[1].map.log_odds.size(), -999.0F);
  Recording recording = random_recording(2, 36, 876);
  for (glm::dvec2& element : recording.elements_mm) {
    element *= 0.1;
  }
  for (Pose& pose : recording.T_robot_sensor) {
    pose.translation_mm *= 0.05;
  }
  recording.pressure.assign(recording.pressure.size(), 10.0);
  BoundedOptions options = few_bins();
  options.contact.gamma = 0.0;
  options.lattice.x_mm = {-2.0, 2.0, 9};
  options.lattice.y_mm = {-2.0, 2.0, 8};
  const Certified seen = expect_certificate(hard, objects, options, recording, 1e-7);
  EXPECT_TRUE(seen.estimate.contradicted);
  EXPECT_EQ(seen.estimate.mode.object, 1);
  EXPECT_NEAR(seen.estimate.mode.log_likelihood, -2.0 * 36.0 * 999.0, 1e-6);
}

TEST(BoundedHard, AThousandTouchesOfOneSpot) {
  HardCase hard("bounds: the same touch 1,000 times",
                "penalties add up to a million nats; the mass shrinks to one bin",
                "integers widen; leaves sum in float64");
  const std::vector<Hypothesis> objects = two_objects(6.0, 879);
  const Recording recording = random_recording(1, 24, 880);
  const BoundedOptions options = few_bins();
  reference::Posterior truth =
      reference_posterior(objects, options, std::vector{recording.touch(0)});
  for (std::vector<double>& logs : truth.log_likelihood) {
    for (double& l : logs) {
      l *= 1000.0;
    }
  }
  BoundedPosterior posterior(objects, options);
  posterior.update(std::vector(1000, recording.touch(0)));
  // 24,000 elements of 1e-15 and some 1e4 nats of 16 digits.
  const Certified seen = expect_certified(posterior, objects, options, truth, 1e-6);
  hard.expect("total variation", seen.total_variation, options.tolerance + 2e-6);
  hard.expect("certificate", seen.estimate.certificate->dropped_mass, options.tolerance);
}

}  // namespace
}  // namespace palpate
