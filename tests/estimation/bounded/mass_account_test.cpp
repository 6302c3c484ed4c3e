#include "estimation/bounded/search/mass_account.hpp"

#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "support/limits.hpp"

namespace palpate::mass_account_test {

const std::array<double, 2> log_weight{std::log(0.25), std::log(0.75)};
const std::array<std::size_t, 2> label_of{0, 1};

struct Account {
  PoseLattice lattice{.x_mm = {0.0, 1.0, 10}, .y_mm = {0.0, 1.0, 10}, .theta_rad = {0.0, 1.0, 10}};
  SearchGoal goal;
  MassAccount account{log_weight, label_of, lattice, goal};
};

TEST(MassAccount, CountsTheRoundingOfSumsOfUndisplacedBins) {
  for (const std::int64_t bins : {std::int64_t{1}, std::int64_t{1'000'000}}) {
    Account of;
    of.account.settle(0, bins, -300.0, -310.0, 0.0);
    const HypothesisMass mass = of.account.result().mass[0];
    EXPECT_NEAR(mass.evaluated, log_weight[0] - 300.0, 1e-12);
    const double share = std::exp(mass.rounding - mass.evaluated);
    // Sequential additions round by half a unit each, and an exponential by at least as much.
    EXPECT_GE(share, static_cast<double>(bins) * 0x1p-53);
    EXPECT_LE(share, static_cast<double>(bins) * 16.0 * 0x1p-53);
  }
}

TEST(MassAccount, AddsTheErrorsOfBinsToTheirRounding) {
  Account of;
  of.account.settle(1, 100, -7.0, -9.0, 1e-3);
  of.account.settle(1, 100, -8.0, -9.0, 2e-3);
  const HypothesisMass mass = of.account.result().mass[1];
  const double error =
      0.75 * (std::exp(-7.0) * std::expm1(1e-3) + std::exp(-8.0) * std::expm1(2e-3));
  EXPECT_NEAR(std::exp(mass.rounding), error, 1e-9 * error);
  EXPECT_EQ(of.account.result().mass[0].rounding, -infinity) << "of which nothing is settled";
}

TEST(MassAccount, TakesOnlyWhatIsCertainForTheTotalAndTheBest) {
  Account of;
  of.account.settle(0, 10, -2.0, -3.0, 0.5);
  of.account.raise_totals();
  EXPECT_NEAR(of.account.log_total(), log_weight[0] - 2.0 + std::log(2.0 - std::exp(0.5)), 1e-12);
  EXPECT_NEAR(of.account.best(), log_weight[0] - 3.5, 1e-12);
  EXPECT_NEAR(of.account.best_of(0), -3.5, 1e-12);
}

TEST(MassAccount, TheModeIsCertainWhereNoDroppedBinMayBeat) {
  const BinBox box{.object = 1, .theta = 2, .y_first = 3, .y_count = 2, .x_first = 4, .x_count = 3};
  for (const double largest : {-5.1, -4.9}) {
    Account of;
    of.account.settle(1, 6, -4.0, -5.0, 0.0);
    of.account.note_best(box, 4, -5.0);
    of.account.note_best(box, 5, -5.0);  // of equal bins the first is the mode
    UnsettledMass dropped(2, log_weight[1] + largest);
    dropped.add(1, log_weight[1] + largest, 7);
    of.account.drop(dropped);
    const SearchResult result = of.account.result();
    EXPECT_EQ(result.best_object, 1);
    EXPECT_EQ(result.best_bin, (2 * 10 + 3 + 1) * 10 + 4 + 1);
    EXPECT_NEAR(result.best_log_likelihood, -5.0, 1e-12);
    EXPECT_EQ(result.mode_certain, largest < -5.0);
    EXPECT_GE(result.mass[1].dropped, log_weight[1] + largest + std::log(7.0) - 1e-9);
  }
}

}  // namespace palpate::mass_account_test
