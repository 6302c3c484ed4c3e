// Marginals on a coarser grid, against their definition, bin by bin; and draws: where rounding
// leaves the last of them out, and which blocks they read.

#include "estimation/bin_belief.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "support/synthetic.hpp"

namespace palpate::bin_belief_test {

constexpr PoseLattice bins{.x_mm = {-10.0, 10.0, 23},
                           .y_mm = {-7.0, 11.0, 17},
                           .theta_rad = {0.0, two_pi, 9},
                           .pivot_mm = {30.0, -4.0}};
constexpr BinBox box{
    .object = 0, .theta = 5, .y_first = 3, .y_count = 11, .x_first = 2, .x_count = 20};

/// The marginals by PoseLattice::bin_of() of every bin's centre.
Marginals by_definition(const PoseLattice& grid, const std::vector<double>& logs, double offset) {
  Marginals sums{.grid = grid,
                 .xy = std::vector<double>(static_cast<std::size_t>(grid.plane())),
                 .theta = std::vector<double>(static_cast<std::size_t>(grid.theta_rad.count))};
  for (int i = 0; i < box.bins(); ++i) {
    const std::int64_t index =
        (std::int64_t{box.theta} * bins.y_mm.count + box.y_first + i / box.x_count) *
            bins.x_mm.count +
        box.x_first + i % box.x_count;
    const std::int64_t at = grid.bin_of(bins.T_object_robot(index));
    const double p = std::exp(logs[logs.size() == 1 ? 0 : static_cast<std::size_t>(i)] + offset);
    sums.xy[static_cast<std::size_t>(at % grid.plane())] += p;
    sums.theta[static_cast<std::size_t>(at / grid.plane())] += p;
  }
  return sums;
}

/// A belief that consists of one box, of log-likelihoods relative to this one.
BinBelief belief_of(const std::vector<double>& log_likelihood, double reference) {
  return {.lattice = bins,
          .objects = {{.reference = reference}},
          .visit = [&](std::span<const int> /*asked*/, const BlockChoice& /*choice*/,
                       const BinVisitor& visitor) { visitor(box, log_likelihood); }};
}

TEST(BinBelief, HasTheMarginalsOfTheirDefinition) {
  std::vector<double> logs;
  for (int i = 0; i < box.bins(); ++i) {
    logs.push_back(-3.0 + std::sin(0.7 * i));
  }
  // Steps that share no border with the bins' centres. The last grid ends within the region.
  for (const PoseLattice& grid :
       {bins, PoseLattice{{-10.0, 10.0, 7}, {-7.0, 11.0, 5}, {0.0, two_pi, 4}, {30, -4}},
        PoseLattice{{-10.0, 10.0, 7}, {-7.0, 11.0, 5}, {0.0, two_pi, 4}, {28, 3}},
        PoseLattice{{-4.0, 3.1, 50}, {-2.0, 4.1, 1}, {1.0, 2.0, 3}, {30, -4}}}) {
    for (const std::vector<double>& likelihoods : {logs, std::vector<double>{-2.0}}) {
      const Marginals actual = belief_of(likelihoods, 1.5).marginals(0, grid);
      const Marginals expected = by_definition(grid, likelihoods, -1.5);
      // Sums of a few hundred float64.
      EXPECT_LE(largest_difference(actual.xy, expected.xy), 1e-12 * box.bins());
      EXPECT_LE(largest_difference(actual.theta, expected.theta), 1e-12 * box.bins());
    }
  }
}

TEST(BinBelief, VisitsNoBinOfAnObjectWhoseProbabilityIsZero) {
  BinBelief belief{.lattice = bins,
                   .objects = {{.log_identity = -746.0}, {.log_identity = -700.0}},
                   .log_objects = -50.0,
                   .visit = [](std::span<const int> /*asked*/, const BlockChoice& /*choice*/,
                               const BinVisitor& /*visitor*/) { FAIL(); }};
  for (const int object : {0, 1}) {
    const Marginals none = belief.marginals(object, bins);
    EXPECT_EQ(none.xy, std::vector<double>(static_cast<std::size_t>(bins.plane())));
    EXPECT_EQ(none.theta, std::vector<double>(static_cast<std::size_t>(bins.theta_rad.count)));
  }
}

TEST(BinBelief, DrawsTheBestBinWhereRoundingLeavesTheLastPartOut) {
  std::vector<double> logs(static_cast<std::size_t>(box.bins()), -100.0);
  logs[7] = 0.0;
  // The sum over the bins is taken to be a tenth larger than it is.
  for (const PoseSample& sample : belief_of(logs, std::log(1.1)).sample(100, 5)) {
    EXPECT_EQ(bins.bin_of(sample.T_object_robot), box.bin(7, bins));
  }
}

TEST(BinBelief, ReadsOnlyBlocksWithADraw) {
  const std::vector<double> alike{-std::log(box.bins())};
  std::vector<bool> read;
  const BinBelief belief{.lattice = bins,
                         .objects = {{}},
                         .visit = [&](std::span<const int> /*asked*/, const BlockChoice& choice,
                                      const BinVisitor& visitor) {
                           for (int y = 0; y < box.y_count; ++y) {  // a block is a row
                             BinBox row = box;
                             row.y_first += y;
                             row.y_count = 1;
                             read.push_back(choice.reads(0, 1.0 / box.y_count));
                             visitor(row, alike);
                           }
                         }};
  std::vector<bool> drawn(static_cast<std::size_t>(box.y_count));
  for (const PoseSample& sample : belief.sample(3, 6)) {
    const std::int64_t bin = bins.bin_of(sample.T_object_robot);
    drawn[static_cast<std::size_t>(bin % bins.plane() / bins.x_mm.count - box.y_first)] = true;
  }
  EXPECT_EQ(read, drawn);
}

}  // namespace palpate::bin_belief_test
