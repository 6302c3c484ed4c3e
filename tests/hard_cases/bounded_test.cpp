// Hard maps, models and touches of the posterior by bounds alone: its laws, and its answers against
// float64 on all bins.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "hard_case.hpp"

namespace palpate::bounded_test {

BoundedOptions few_bins() {
  return {.lattice = {{-5.0, 5.0, 9}, {-5.0, 5.0, 8}, {0.0, two_pi, 7}, {}}};
}

TEST(BoundedHard, MapPriorsOfAMillionth) {
  HardCase hard("bounds: a prior of 1e-6 and of 0.999999");
  BoundedOptions options = few_bins();
  options.lattice.x_mm = {-20.0, 20.0, 11};
  for (const double prior : {1e-6, 0.999999}) {
    for (const double gamma : {0.1, 0.0}) {
      options.contact.prior = prior;
      options.contact.gamma = gamma;
      hard.expect_laws(two_objects(4.0, 841), options, random_recording(4, 20, 840));
    }
  }
}

TEST(BoundedHard, MapsOfDifferentCellSizesTogether) {
  HardCase hard("bounds: maps in cells of 0.1, 0.37, 0.5, 2 and 9 mm together");
  std::vector<Hypothesis> objects;
  for (const double cell_mm : {0.1, 0.37, 0.5, 2.0, 9.0}) {
    const auto cells = static_cast<int>(std::max(2.0, std::min(90.0, 14.0 / cell_mm)));
    objects.push_back({random_map(cells, cells + 1, cell_mm, 4.0, 848), 1.0});
  }
  hard.expect_laws(objects, few_bins(), random_recording(5, 24, 849));
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
      "bounds: a table that is not monotone, of four levels, for all objects and for each");
  const std::vector<Hypothesis> objects = two_objects(9.0, 863);
  const Recording recording = random_recording(4, 24, 865);
  for (const std::size_t sets : {1U, 2U}) {
    for (const double nats : {0.0, 1e-3, 4.0, 300.0, 1e6}) {
      SCOPED_TRACE(::testing::Message() << sets << " sets of " << nats << " nats");
      BoundedOptions options = few_bins();
      options.contact.table = crooked_table(sets, nats, 866);
      // Places known to 1e-14 cells, 36 of log odds in a cell and `nats` in 0.5 of log odds: 1e-12
      // of `nats` per element, which a proof sums over all of them, and over all steps to a place.
      hard.expect_laws(objects, options, recording, std::max(1e-9, 1e-9 * nats));
    }
  }
}

TEST(BoundedHard, BinsWiderThanTheMap) {
  HardCase hard("bounds: bins of 44 mm over a map of 15 mm, and a region that misses the map");
  BoundedOptions options = few_bins();
  options.lattice.y_mm = {-200.0, 190.0, 9};
  for (const Axis& x_mm : {Axis{-200.0, 200.0, 9}, Axis{100.0, 140.0, 9}}) {
    options.lattice.x_mm = x_mm;
    hard.expect_laws(two_objects(6.0, 857), options, random_recording(3, 24, 859));
  }
}

TEST(BoundedHard, ElementsOnTheBoundariesOfCells) {
  HardCase hard("bounds: elements exactly on nodes and cell borders at every bin");
  for (const double cell_mm : {0.5, 1.0, 0.1}) {  // 0.1 mm is no binary fraction
    const std::vector<Hypothesis> objects{{random_map(41, 41, cell_mm, 12.0, 860), 1.0},
                                          {random_map(41, 41, cell_mm, 12.0, 861), 1.0}};
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
      // Centres at whole cells, and quarter turns.
      BoundedOptions options{.lattice = {{-8.5 * cell_mm, 8.5 * cell_mm, 17},
                                         {-7.5 * cell_mm, 7.5 * cell_mm, 15},
                                         {-std::numbers::pi / 4, two_pi - std::numbers::pi / 4, 4},
                                         {}}};
      hard.expect_laws(objects, options, recording);
      options.lattice.theta_rad = {0.0, 0.0, 1};
      hard.expect_laws(objects, options, recording);
    }
  }
}

TEST(BoundedHard, TouchesWithoutAKnownElement) {
  HardCase hard("bounds: touches without a known element, and none at all");
  const std::vector<Hypothesis> objects = two_objects(6.0, 867);
  Recording recording = random_recording(4, 12, 868);
  recording.valid.assign(4 * 12, 1);
  std::fill_n(recording.valid.begin(), 12, 0);
  std::fill_n(recording.valid.begin() + 24, 12, 0);
  hard.expect_laws(objects, few_bins(), recording);
  recording.valid.assign(4 * 12, 0);
  const Certified seen = hard.expect_laws(objects, few_bins(), recording);
  EXPECT_EQ(seen.estimate.mode.log_likelihood, 0.0);
  EXPECT_EQ(seen.estimate.mode.object, 0);
}

TEST(BoundedHard, OneReadingAlone) {
  HardCase hard("bounds: touches of In Contact alone, and of No Contact alone");
  Recording recording = random_recording(4, 12, 870);
  recording.pressure.assign(4 * 12, 0.0);
  std::fill_n(recording.pressure.begin(), 24, 10.0);
  hard.expect_laws(two_objects(6.0, 869), few_bins(), recording);
}

}  // namespace palpate::bounded_test
