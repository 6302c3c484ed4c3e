// Hard cases of the posterior by bounds: its certificate and answers against float64 on all bins.

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "bounded/certified.hpp"
#include "hard_case.hpp"

namespace palpate::bounded_test {

BoundedOptions small_options() {
  BoundedOptions options;
  options.lattice = {.x_mm = {-5.0, 5.0, 9}, .y_mm = {-5.0, 5.0, 8}, .theta_rad = {0, two_pi, 7}};
  return options;
}

std::vector<Hypothesis> two_objects(double steepness, std::uint64_t seed) {
  return {{random_map(31, 27, 0.5, steepness, seed), 1.0},
          {random_map(27, 33, 0.5, steepness, seed + 1), 1.0}};
}

/// Expects the certificate to hold after every touch, and one object's answers to be the tolerance
/// away from float64 at most.
/// @param nats what rounding may add to a log-likelihood
Certified expect_certificate(HardCase& hard, const std::vector<Hypothesis>& objects,
                             const BoundedOptions& options, const Recording& recording,
                             double nats = 1e-9) {
  Device device = Device::open();
  BoundedPosterior posterior(device, objects, options);
  Certified seen;
  for (std::size_t n = 0; n <= recording.size(); ++n) {
    SCOPED_TRACE(::testing::Message() << n << " touches");
    if (n > 0) {
      posterior.update(recording.touch(n - 1));
    }
    seen = expect_certified(posterior, objects, options,
                            reference_posterior(objects, options, recording.touches(0, n)), nats);
    EXPECT_TRUE(all_finite(seen.estimate.identity));
    const RefinedPose refined = posterior.refine(seen.estimate.mode);
    EXPECT_TRUE(all_finite(refined.covariance));
    EXPECT_TRUE(all_finite(std::vector{refined.T_object_robot.translation_mm.x,
                                       refined.T_object_robot.translation_mm.y,
                                       refined.T_object_robot.theta_rad}));
    const double rounded = 2.0 * nats + 1e-14;
    hard.expect("identity", seen.identity_error, options.tolerance + rounded);
    hard.expect("total variation", seen.total_variation, options.tolerance + rounded);
    if (seen.estimate.certificate) {
      hard.expect("certificate", seen.estimate.certificate->dropped_mass,
                  options.tolerance + rounded);
    }
  }
  return seen;
}

TEST(BoundedHard, CertainMapsWithoutGamma) {
  HardCase hard("bounds: gamma = 0 on maps at log odds of +-1,000",
                "penalties of 1,000 nats saturate 16 bits and hide which tile is best",
                "a saturated penalty still bounds from above; leaves decide in float64");
  std::vector<Hypothesis> objects = two_objects(1.0, 831);
  for (Hypothesis& object : objects) {
    for (float& l : object.map.log_odds) {
      l = l > 0.0F ? 1000.0F : -1000.0F;
    }
  }
  const Recording recording = random_recording(4, 36, 833);
  for (const double gamma : {0.0, 1e-300, 1e-30, 0.1}) {
    SCOPED_TRACE(::testing::Message() << "gamma " << gamma);
    BoundedOptions options = small_options();
    options.contact.gamma = gamma;
    // A place is known to 1e-15 mm, which is worth 4e-12 nats at 4,000 nats a mm.
    expect_certificate(hard, objects, options, recording, 1e-7);
  }
}

TEST(BoundedHard, LogOddsAtTheLargestThatAMapMayHold) {
  HardCase hard("bounds: log odds of +-1e30, gamma 0 and 0.1",
                "penalties of 1e30 nats leave every integer, sums leave float32",
                "penalties saturate; what a bin costs is float64's");
  std::vector<Hypothesis> objects = two_objects(1.0, 834);
  objects[0].map.log_odds.assign(objects[0].map.log_odds.size(), 1e30F);
  objects[1].map.log_odds.assign(objects[1].map.log_odds.size(), -1e30F);
  Recording recording = random_recording(2, 9, 836);
  for (glm::dvec2& element : recording.elements_mm) {
    element *= 0.1;  // far from the border, where the log odds fall to the prior's
  }
  for (Pose& pose : recording.T_robot_sensor) {
    pose.translation_mm *= 0.05;
  }
  BoundedOptions options = small_options();
  options.lattice.x_mm = {-1.0, 1.0, 5};
  options.lattice.y_mm = {-1.0, 1.0, 4};
  for (const double gamma : {0.0, 0.1}) {
    options.contact.gamma = gamma;
    for (const double pressure : {10.0, 0.0}) {
      for (double& p : recording.pressure) {
        p = pressure;
      }
      // 1e31 nats keep 16 digits. With a floor the likelihood is near exact, but rounding that may
      // move such log odds by more than the floor's depth proves nothing: all may be missing.
      expect_certificate(hard, objects, options, recording, gamma > 0.0 ? 1.0 : 1e16);
    }
  }
}

TEST(BoundedHard, PriorWeightsOfAMillionth) {
  HardCase hard("bounds: prior weights of 1e-6 and 1e-300 beside 1",
                "a light object's tiles are dropped before the touches speak for it",
                "tiles compete by weight times mass; its log evidence keeps its bounds");
  const Recording recording = random_recording(6, 36, 837);
  for (const double weight : {1e-6, 1e-300}) {
    for (const std::size_t light : {0U, 1U}) {
      std::vector<Hypothesis> objects = two_objects(4.0, 838);
      objects[light].weight = weight;
      BoundedOptions options = small_options();
      expect_certificate(hard, objects, options, recording);
      options.evidence_nats = 0.1;
      const Certified seen = expect_certificate(hard, objects, options, recording);
      EXPECT_LE(seen.widest_nats, 0.1);
    }
  }
}

TEST(BoundedHard, MapPriorsOfAMillionth) {
  HardCase hard("bounds: a prior of 1e-6 and of 0.999999",
                "beyond the maps one class costs 14 nats, which no cell of the map shows",
                "the space beyond a map is part of its windows");
  const Recording recording = random_recording(4, 20, 840);
  for (const double prior : {1e-6, 0.999999}) {
    for (const double gamma : {0.1, 0.0}) {
      BoundedOptions options = small_options();
      options.contact.prior = prior;
      options.contact.gamma = gamma;
      options.lattice.x_mm = {-20.0, 20.0, 11};
      expect_certificate(hard, two_objects(4.0, 841), options, recording);
    }
  }
}

TEST(BoundedHard, CellsOfTwoHundredthsOfAMillimetre) {
  HardCase hard("bounds: map cells of 0.02 mm, bins of 1 mm and of 4 um",
                "a tile holds less than a bin, or a bin less than a cell",
                "tiles are sized in cells; those without a bin are no tiles");
  const std::vector<Hypothesis> objects{{random_map(251, 241, 0.02, 6.0, 842), 1.0},
                                        {random_map(31, 27, 0.5, 6.0, 843), 1.0}};
  const Recording recording = random_recording(3, 20, 844);
  BoundedOptions options = small_options();
  // 1e-14 mm of a place are 5e-13 cells of 24 nats.
  expect_certificate(hard, objects, options, recording, 1e-8);
  options.lattice.x_mm = {0.0, 0.04, 10};
  options.lattice.y_mm = {0.0, 0.04, 10};
  expect_certificate(hard, objects, options, recording, 1e-8);
}

TEST(BoundedHard, CellsOfAHundredMillimetres) {
  HardCase hard("bounds: map cells of 100 mm", "all bins lie in one cell, and in one tile",
                "the window of that tile is one cell; leaves take over");
  const std::vector<Hypothesis> objects{{random_map(5, 4, 100.0, 12.0, 845), 1.0},
                                        {random_map(31, 27, 0.5, 6.0, 846), 1.0}};
  const Recording recording = random_recording(4, 36, 847);
  BoundedOptions options = small_options();
  expect_certificate(hard, objects, options, recording);
  options.lattice.x_mm = {-0.3, 0.3, 6};
  options.lattice.y_mm = {-200.0, 300.0, 5};
  expect_certificate(hard, objects, options, recording);
}

TEST(BoundedHard, MapsOfDifferentCellSizesTogether) {
  HardCase hard("bounds: maps in cells of 0.1, 0.37, 0.5, 2 and 9 mm together",
                "tiles of one level differ from map to map",
                "each map has levels of its own; they compete by mass");
  std::vector<Hypothesis> objects;
  for (const double cell_mm : {0.1, 0.37, 0.5, 2.0, 9.0}) {
    const auto cells = static_cast<int>(std::max(2.0, std::min(90.0, 14.0 / cell_mm)));
    objects.push_back({random_map(cells, cells + 1, cell_mm, 4.0, 848), 1.0});
  }
  expect_certificate(hard, objects, small_options(), random_recording(5, 24, 849));
}

TEST(BoundedHard, PivotsAndObjectsFarAway) {
  HardCase hard("bounds: pivots 1e5 mm away, with and without the touches",
                "elements are 2e5 cells from the pivot; a turn flings them off every map",
                "offsets are whole cells and a fraction; 1e-10 mm of places in float64");
  const std::vector<Hypothesis> objects = two_objects(6.0, 850);
  const Recording near = random_recording(4, 24, 851);
  for (const glm::dvec2 away_mm : {glm::dvec2(1e5, -1e5), glm::dvec2(0.0, 1e5)}) {
    BoundedOptions options = small_options();
    options.lattice.pivot_mm = away_mm;
    // 1.5e-11 mm of 1e5 mm are 3e-11 cells of 12 nats, times 100 elements and turns.
    expect_certificate(hard, objects, options, moved(near, {away_mm, 0.0}), 1e-6);
    expect_certificate(hard, objects, options, near, 1e-6);  // far from the pivot: off the maps
  }
  // A fine lattice about the far pivot, at one theta.
  BoundedOptions options = small_options();
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
  BoundedOptions options = small_options();
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
  BoundedOptions options = small_options();
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

/// Numbers that no function of occupancy would have: neither monotone nor smooth, of four levels.
LikelihoodTable crooked_table(std::size_t objects, double nats, std::uint64_t seed) {
  Uniform random(seed);
  LikelihoodTable table{.first_log_odds = -7.0,
                        .last_log_odds = 5.0,
                        .nodes = 23,
                        .level_edges = {8.0, 13.0},
                        .log_likelihood = {}};
  for (std::size_t i = 0; i < objects * table.levels() * table.nodes; ++i) {
    table.log_likelihood.push_back(random(-nats, nats));
  }
  return table;
}

TEST(BoundedHard, ACrookedTable) {
  HardCase hard(
      "bounds: a table that is not monotone, of four levels, for all objects and for each",
      "the least penalty of a window lies between its nodes, or above 0",
      "a window's bound is the table's largest value over the range of its log odds");
  const std::vector<Hypothesis> objects = two_objects(9.0, 863);
  const Recording recording = random_recording(4, 24, 865);
  for (const std::size_t sets : {1U, 2U}) {
    for (const double nats : {0.0, 1e-3, 4.0, 300.0, 1e6}) {
      SCOPED_TRACE(::testing::Message() << sets << " sets of " << nats << " nats");
      BoundedOptions options = small_options();
      options.contact.table = crooked_table(sets, nats, 866);
      // Places known to 1e-14 cells, 36 of log odds in a cell and `nats` in 0.5 of log odds: 1e-12
      // of `nats` per element, which a proof sums over all of them, and over all steps to a place.
      expect_certificate(hard, objects, options, recording, std::max(1e-9, 1e-9 * nats));
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
  expect_certificate(hard, objects, small_options(), recording);
  std::fill(recording.valid.begin(), recording.valid.end(), 0);
  const Certified seen = expect_certificate(hard, objects, small_options(), recording);
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
  expect_certificate(hard, objects, small_options(), recording);
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
  BoundedOptions options = small_options();
  options.contact.gamma = 0.0;
  options.lattice.x_mm = {-2.0, 2.0, 9};
  options.lattice.y_mm = {-2.0, 2.0, 8};
  const Certified seen = expect_certificate(hard, objects, options, recording, 1e-7);
  EXPECT_TRUE(seen.estimate.contradicted);
  EXPECT_EQ(seen.estimate.mode.object, 1);
  EXPECT_NEAR(seen.estimate.mode.log_likelihood, -2.0 * 36.0 * 999.0, 1e-6);
}

TEST(BoundedHard, IdenticalObjectsAndSymmetricOnes) {
  HardCase hard("bounds: identical objects, and maps of equal cells",
                "equal bounds: one of the twins is dropped with all that it holds",
                "tiles are dropped by mass; what is dropped stays below the tolerance");
  const OccupancyGrid map = random_map(31, 27, 0.5, 6.0, 877);
  OccupancyGrid flat = map;
  flat.log_odds.assign(flat.log_odds.size(), 2.0F);
  const Recording recording = random_recording(4, 24, 878);
  const std::vector<Hypothesis> equal{{map, 1.0}, {map, 1.0}, {map, 2.0}};
  const Certified seen = expect_certificate(hard, equal, small_options(), recording);
  EXPECT_EQ(seen.estimate.mode.object, 2);
  EXPECT_NEAR(seen.estimate.identity[2], 0.5, small_options().tolerance);
  expect_certificate(hard, std::vector<Hypothesis>{{flat, 1.0}, {flat, 1.0}}, small_options(),
                     recording);
}

TEST(BoundedHard, AThousandTouchesOfOneSpot) {
  HardCase hard("bounds: the same touch 1,000 times",
                "penalties add up to a million nats; the mass shrinks to one bin",
                "integers widen; leaves sum in float64");
  const std::vector<Hypothesis> objects = two_objects(6.0, 879);
  const Recording recording = random_recording(1, 24, 880);
  const BoundedOptions options = small_options();
  reference::Posterior truth =
      reference_posterior(objects, options, std::vector{recording.touch(0)});
  for (std::vector<double>& logs : truth.log_likelihood) {
    for (double& l : logs) {
      l *= 1000.0;
    }
  }
  Device device = Device::open();
  BoundedPosterior posterior(device, objects, options);
  posterior.update(std::vector(1000, recording.touch(0)));
  // 24,000 elements of 1e-15 and some 1e4 nats of 16 digits.
  const Certified seen = expect_certified(posterior, objects, options, truth, 1e-6);
  hard.expect("total variation", seen.total_variation, options.tolerance + 2e-6);
  hard.expect("certificate", seen.estimate.certificate->dropped_mass, options.tolerance);
}

}  // namespace palpate::bounded_test
