// Hard maps, models and objects of the posterior by bounds: its certificate and answers against
// float64 on all bins.

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "bounded_case.hpp"

namespace palpate {
namespace {

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
    BoundedOptions options = few_bins();
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
  BoundedOptions options = few_bins();
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
      BoundedOptions options = few_bins();
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
      BoundedOptions options = few_bins();
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
  BoundedOptions options = few_bins();
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
  BoundedOptions options = few_bins();
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
  expect_certificate(hard, objects, few_bins(), random_recording(5, 24, 849));
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
      BoundedOptions options = few_bins();
      options.contact.table = crooked_table(sets, nats, 866);
      // Places known to 1e-14 cells, 36 of log odds in a cell and `nats` in 0.5 of log odds: 1e-12
      // of `nats` per element, which a proof sums over all of them, and over all steps to a place.
      expect_certificate(hard, objects, options, recording, std::max(1e-9, 1e-9 * nats));
    }
  }
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
  const Certified seen = expect_certificate(hard, equal, few_bins(), recording);
  EXPECT_EQ(seen.estimate.mode.object, 2);
  EXPECT_NEAR(seen.estimate.identity[2], 0.5, few_bins().tolerance);
  expect_certificate(hard, std::vector<Hypothesis>{{flat, 1.0}, {flat, 1.0}}, few_bins(),
                     recording);
}

}  // namespace
}  // namespace palpate
