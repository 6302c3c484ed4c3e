#include "estimation/bounded/search/mass_account.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "estimation/log_sum.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"

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

constexpr double slot_nats = 1.0 / 16.0;
/// Rounding of sums of logs of some hundred nats.
constexpr double rounding = 1e-9;

/// Bins of one bound.
struct Bins {
  std::size_t hypothesis = 0;
  double bound = 0.0;
  std::int64_t count = 0;
};

std::vector<Bins> random_bins(std::size_t count, std::size_t hypotheses, double range,
                              std::uint64_t seed) {
  Uniform random(seed);
  std::vector<Bins> bins;
  for (std::size_t i = 0; i < count; ++i) {
    bins.push_back({.hypothesis = static_cast<std::size_t>(random(0.0, 1.0) * hypotheses),
                    .bound = -123.4 - random(0.0, range),
                    .count = static_cast<std::int64_t>(std::exp(random(0.0, 15.0)))});
  }
  return bins;
}

UnsettledMass mass_of(const std::vector<Bins>& bins, std::size_t hypotheses) {
  UnsettledMass mass(hypotheses, std::ranges::max(bins, {}, &Bins::bound).bound);
  for (const Bins& of : bins) {
    mass.add(of.hypothesis, of.bound, of.count);
  }
  return mass;
}

/// The log of a sum of numbers that are given by their logs, by sorting.
double log_of_sum(std::vector<double> logs) {
  std::ranges::sort(logs);
  long double sum = 0.0L;
  for (const double log : logs) {
    sum += std::exp(static_cast<long double>(log) - logs.back());
  }
  return logs.empty() ? -infinity : logs.back() + static_cast<double>(std::log(sum));
}

/// The log of the summed mass of bins that `counts` chooses.
template <typename Counts>
double log_mass(const std::vector<Bins>& bins, const Counts& counts) {
  std::vector<double> logs;
  for (const Bins& of : bins) {
    if (counts(of)) {
      logs.push_back(of.bound + std::log(static_cast<double>(of.count)));
    }
  }
  return log_of_sum(logs);
}

/// Drops no more than allowed, and would drop more than a slot's width less if it dropped a slot
/// more.
template <typename Of>
void expect_fitting(const std::vector<Bins>& bins, const UnsettledMass& mass, std::size_t from,
                    double allowance, const Of& of) {
  ASSERT_LE(from, UnsettledMass::slots);
  EXPECT_LE(log_mass(bins, [&](const Bins& b) { return of(b) && mass.slot(b.bound) >= from; }),
            allowance + rounding);
  if (from > 0) {
    EXPECT_GT(
        log_mass(bins, [&](const Bins& b) { return of(b) && mass.slot(b.bound) + 1 >= from; }),
        allowance - slot_nats - rounding)
        << "from slot " << from << ", allowance " << allowance;
  }
}

TEST(UnsettledMass, FindsWhatMayBeDropped) {
  for (const double range : {0.01, 1.0, 30.0, 250.0}) {
    for (const std::size_t count : {1U, 7U, 63U, 1000U}) {
      const std::vector<Bins> bins = random_bins(count, 3, range, 301 + count);
      const UnsettledMass mass = mass_of(bins, 3);
      for (double allowance = -500.0; allowance < -90.0; allowance += 3.7) {
        SCOPED_TRACE(testing::Message() << count << " over " << range << " nats");
        expect_fitting(bins, mass, mass.droppable_from(allowance), allowance,
                       [](const Bins&) { return true; });
        for (std::size_t i = 0; i < 3; ++i) {
          expect_fitting(bins, mass, mass.droppable_from(i, allowance), allowance,
                         [&](const Bins& b) { return b.hypothesis == i; });
        }
      }
    }
  }
}

TEST(UnsettledMass, BoundsTheMassOfEveryHypothesis) {
  const std::vector<Bins> bins = random_bins(500, 4, 200.0, 302);
  UnsettledMass mass = mass_of(bins, 4);
  for (std::size_t i = 0; i < 4; ++i) {
    const double exact = log_mass(bins, [&](const Bins& b) { return b.hypothesis == i; });
    EXPECT_GE(mass.log_mass(i), exact - rounding);
    EXPECT_LE(mass.log_mass(i), exact + slot_nats + rounding);
    double largest = -infinity;
    for (const Bins& of : bins) {
      largest = of.hypothesis == i ? std::max(largest, of.bound) : largest;
    }
    EXPECT_GE(mass.largest(i), largest);
    EXPECT_LE(mass.largest(i), largest + slot_nats + rounding);
  }
  // What is taken out no longer counts.
  for (const Bins& of : bins) {
    if (of.hypothesis == 1 || of.bound > -200.0) {
      mass.remove(of.hypothesis, of.bound, of.count);
    }
  }
  EXPECT_EQ(mass.log_mass(1), -infinity);
  EXPECT_EQ(mass.largest(1), -infinity);
  EXPECT_LE(mass.largest(2), -200.0 + slot_nats);
  const double exact =
      log_mass(bins, [](const Bins& b) { return b.hypothesis == 2 && b.bound <= -200.0; });
  EXPECT_NEAR(mass.log_mass(2), exact, slot_nats + rounding);
}

TEST(UnsettledMass, StaysWhereAllFarAboveItIsTakenOut) {
  UnsettledMass mass(1, -3.0, 1.0);
  mass.add(0, -3.0, 5);
  mass.add(0, -2003.0, 7);
  mass.remove(0, -3.0, 5);
  EXPECT_NEAR(mass.log_mass(0), -2003.0 + std::log(7.0), rounding);
  EXPECT_EQ(mass.largest(0), -2003.0);
  const std::size_t slot = mass.slot(-2003.0);
  EXPECT_EQ(mass.droppable_from(-2003.0 + 2.0), 0U);
  EXPECT_EQ(mass.droppable_from(-2003.0 + 1.0), slot + 1);
}

TEST(UnsettledMass, DropsNothingWhereThereIsNoneOrNoMassIsKnown) {
  UnsettledMass mass(2, -3.0);
  for (const double allowance : {-infinity, -1e300, 0.0, infinity}) {
    EXPECT_EQ(mass.droppable_from(allowance), 0U);
    EXPECT_EQ(mass.droppable_from(1, allowance), 0U);
  }
  EXPECT_EQ(mass.log_mass(0), -infinity);
  EXPECT_EQ(mass.largest(0), -infinity);
  mass.add(0, -5.0, 7);
  EXPECT_GT(mass.droppable_from(-infinity), mass.slot(-5.0));
  EXPECT_GT(mass.droppable_from(std::size_t{0}, -infinity), mass.slot(-5.0));
  EXPECT_EQ(mass.droppable_from(infinity), 0U);
}

TEST(UnsettledMass, CountsBinsFarBelowAsIfTheyWereInTheLastSlot) {
  UnsettledMass mass(1, -3.0);
  const double edge = -3.0 - slot_nats * static_cast<double>(UnsettledMass::slots - 1);
  for (const double bound : {edge, edge - 1.0, -1e6, -1e300, -infinity}) {
    EXPECT_EQ(mass.slot(bound), UnsettledMass::slots - 1);
    mass.add(0, bound, 2);
  }
  EXPECT_NEAR(mass.log_mass(0), edge + std::log(10.0), rounding);
  EXPECT_EQ(mass.largest(0), edge);
  EXPECT_EQ(mass.droppable_from(edge + std::log(10.0) + 1e-6), 0U);
  EXPECT_EQ(mass.droppable_from(edge + std::log(10.0) - 1e-6), UnsettledMass::slots);
  mass.remove(0, -1e6, 10);
  EXPECT_EQ(mass.log_mass(0), -infinity);
}

TEST(UnsettledMass, PutsBoundsAboveTheLargestIntoTheFirstSlot) {
  const UnsettledMass mass(1, -3.0);
  EXPECT_EQ(mass.slot(-2.0), 0U);
  EXPECT_EQ(mass.slot(infinity), 0U);
  std::size_t last = 0;
  for (double bound = -3.0; bound > -280.0; bound -= 0.01) {
    ASSERT_GE(mass.slot(bound), last) << bound;
    last = mass.slot(bound);
  }
}

TEST(LogSum, AddsAndSubtractsLogsAndNothing) {
  LogSum sum;
  EXPECT_EQ(sum.log(), -infinity);
  sum.add(-infinity);
  EXPECT_EQ(sum.log(), -infinity);
  sum.add(-1e300);
  EXPECT_EQ(sum.log(), -1e300);
  EXPECT_NEAR(log_add(std::log(3.0), std::log(5.0)), std::log(8.0), 1e-15);
  EXPECT_EQ(log_add(-infinity, -infinity), -infinity);
  EXPECT_EQ(log_add(-infinity, 2.0), 2.0);
  EXPECT_EQ(log_add(2.0, -infinity), 2.0);
  EXPECT_NEAR(log_subtract(std::log(8.0), std::log(5.0)), std::log(3.0), 1e-15);
  EXPECT_EQ(log_subtract(2.0, -infinity), 2.0);
  EXPECT_EQ(log_subtract(2.0, 2.0), -infinity);
  EXPECT_EQ(log_subtract(2.0, 3.0), -infinity);
  EXPECT_EQ(log_subtract(-infinity, -infinity), -infinity);
}

}  // namespace palpate::mass_account_test
