// "None of these" by bounds, against its definition over all bins in float64; how closely the
// bounded posterior bounds it, and where a search ends early.

#include "estimation/bounded/none_evidence.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "bound_cases.hpp"
#include "estimation/hypotheses.hpp"
#include "estimation/log_sum.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"
#include "support/trials.hpp"

namespace palpate::none_evidence_test {

/// Rounding of the definition's float64 sums over some 100,000 bins of some hundred nats.
constexpr double rounding = 1e-9;
/// In nats: as wide as the bounds after a few searches.
constexpr double first_width = 0.7;

std::vector<Hypothesis> two_objects() {
  return {{random_map(31, 27, 0.5, 4.0, 701), 2.0}, {random_map(23, 29, 0.5, 4.0, 702), 1.0}};
}

class NoneByBounds {
 public:
  NoneByBounds(std::vector<Hypothesis> hypotheses, const PoseLattice& lattice,
               const ContactModel& contact = {}, const DisplacementSd& touch_sd = {})
      : objects(std::move(hypotheses)),
        options{.lattice = lattice, .contact = resolve(contact, objects), .touch_sd = touch_sd},
        likelihood(objects, options.contact, lattice, touch_sd),
        space(objects, options),
        none(space, options, likelihood) {}

  void add(std::span<const Touch> touches) { none.add(evidence_of(touches, options.contact)); }
  LogInterval bounds(double width_nats = first_width) {
    return none.bounds(
        [&](const LogInterval& found) { return found.high - found.low <= width_nats; },
        Deadline({}));
  }
  LogInterval bounds_of(std::span<const Touch> touches) {
    none.reset();
    add(touches);
    return bounds();
  }

  /// Its definition, by all bins, where touches lie as the robot says.
  double expected(std::span<const Touch> touches) const {
    std::vector<std::vector<std::vector<double>>> logs;
    for (const Touch& touch : touches) {
      logs.emplace_back();
      for (std::size_t object = 0; object < objects.size(); ++object) {
        logs.back().push_back(reference::log_likelihoods(
            std::span(&touch, 1), options.lattice, objects[object].map, options.contact, object));
      }
    }
    return reference::none_log_evidence(touches, options.lattice, objects, logs);
  }

  std::vector<Hypothesis> objects;
  BoundedOptions options;
  BinLikelihood likelihood;
  SearchSpace space;
  NoneEvidence none;
};

void expect_same(const LogInterval& a, const LogInterval& b) {
  EXPECT_EQ(a.low, b.low);
  EXPECT_EQ(a.high, b.high);
}

void expect_holds(const LogInterval& bounds, double value, double width_nats) {
  EXPECT_LE(bounds.low, value + rounding);
  EXPECT_GE(bounds.high, value - rounding);
  EXPECT_LE(bounds.high - bounds.low, width_nats);
}

/// Expects the bounds to hold the definition after a few searches, and after more of them.
void expect_definition(NoneByBounds& none, std::span<const Touch> touches,
                       double close_nats = 1e-6) {
  const double expected = none.expected(touches);
  expect_holds(none.bounds_of(touches), expected, first_width);
  expect_holds(none.bounds(close_nats), expected, close_nats);
}

PoseLattice lattice_of(int x, int y, int theta) {
  return {.x_mm = {-15.0, 16.0, x},
          .y_mm = {-14.0, 15.0, y},
          .theta_rad = {0, two_pi, theta},
          .pivot_mm = {3.0, -2.0}};
}

TEST(NoneEvidence, HoldsItsDefinition) {
  const ContactModel learned{.prior = 0.2, .table = crooked_table()};
  std::uint64_t seed = 703;
  for (const ContactModel& contact :
       {ContactModel{}, ContactModel{.gamma = 0.01}, ContactModel{.gamma = 0.0}, learned}) {
    for (const PoseLattice& lattice :
         {lattice_of(21, 19, 8), lattice_of(60, 3, 12), lattice_of(9, 80, 5)}) {
      NoneByBounds none(two_objects(), lattice, contact);
      EXPECT_EQ(none.bounds().high, 0.0);
      for (const std::size_t elements : {8, 36, 150}) {
        if (elements == 150 && (sanitized || lattice.theta_rad.count != 5)) {
          continue;  // takes long
        }
        SCOPED_TRACE(fmt::format("{} elements, seed {}", elements, ++seed));
        const Recording recording = random_recording(1, elements, seed);
        const std::vector<Touch> touches = all_touches(recording);
        // The table is so steep that its float64 rounding may be more.
        const KnownElements known =
            known_elements(TouchEvidence(touches[0], none.options.contact), none.options);
        const double error =
            std::max(none.likelihood.error(0, known), none.likelihood.error(1, known));
        expect_definition(none, touches, std::max(1e-6, 2.5 * error));
      }
    }
  }
}

TEST(NoneEvidence, LeavesOutThatTouchesAreDisplaced) {
  const Recording recording = random_recording(2, 36, 720);
  for (const DisplacementSd& sd : {DisplacementSd{2.0, 0.33}, DisplacementSd{0.0, 0.3}}) {
    NoneByBounds displaced(two_objects(), lattice_of(19, 17, 20), {}, sd);
    expect_definition(displaced, all_touches(recording));
  }
}

TEST(NoneEvidence, CountsAnObjectOfSmallPriorThatAloneExplainsTheTouch) {
  // Only the light object is full; a press of 12 elements is worth 0.08^-12 of likelihood there.
  std::vector<Hypothesis> objects = two_objects();
  objects[0].map.log_odds.assign(objects[0].map.log_odds.size(), -8.0F);
  objects[0].map.log_odds.front() = 0.1F;  // so that its box holds the whole map
  objects[0].map.log_odds.back() = 0.1F;
  objects[1].map.log_odds.assign(objects[1].map.log_odds.size(), 8.0F);
  objects[1].weight = 1e-6;
  NoneByBounds none(objects, lattice_of(30, 30, 10));
  Recording recording = random_recording(1, 12, 705);
  for (glm::dvec2& element_mm : recording.elements_mm) {
    element_mm *= 0.2;
  }
  recording.pressure.assign(12, 10.0);
  expect_definition(none, all_touches(recording));
}

TEST(NoneEvidence, CountsAllBinsWhereTheArrayMeetsNoObject) {
  Recording recording = random_recording(2, 8, 706);
  recording.T_robot_sensor[0].translation_mm += glm::dvec2(200.0, 0.0);
  const std::vector<Touch> touches = all_touches(recording);
  const std::span<const Touch> first(touches.data(), 1);
  for (const PoseLattice& lattice : {lattice_of(21, 19, 8), lattice_of(40, 30, 5)}) {
    NoneByBounds none(two_objects(), lattice);
    // Every bin sees nothing but the prior, and s is 1: it counts once, at the first touch.
    expect_holds(none.bounds_of(first), none.expected(first), 1e-9);
    expect_definition(none, touches);
  }
}

TEST(NoneEvidence, CountsNoTouchWithoutAKnownElement) {
  NoneByBounds none(two_objects(), lattice_of(21, 19, 8));
  const Recording recording = random_recording(2, 8, 707);
  const std::vector<std::uint8_t> dead(8, 0);
  Touch silent = recording.touch(1);
  silent.valid = dead;
  EXPECT_EQ(none.bounds_of(std::vector{silent}).high, 0.0);
  expect_same(none.bounds_of(std::vector{silent, recording.touch(0), silent}),
              none.bounds_of(std::vector{recording.touch(0)}));
}

TEST(NoneEvidence, HoldsItsDefinitionOverOneBin) {
  const Recording recording = random_recording(3, 8, 708);
  for (const double x : {0.0, 30.0}) {
    NoneByBounds none(two_objects(), {{x, x, 1}, {0.5, 0.5, 1}, {0.4, 0.4, 1}, {}});
    expect_definition(none, all_touches(recording), 1e-8);
  }
}

TEST(NoneEvidence, DoesNotDependOnTheOrderButForTheFirstShare) {
  const Recording recording = random_recording(4, 8, 709);
  std::vector<Touch> touches = all_touches(recording);
  touches.push_back(touches[1]);  // one comes twice
  NoneByBounds none(two_objects(), lattice_of(30, 30, 8));
  const LogInterval forth = none.bounds_of(touches);
  std::reverse(touches.begin() + 1, touches.end());  // the first stays the first
  expect_same(none.bounds_of(touches), forth);
  std::ranges::reverse(touches);
  expect_definition(none, touches);
}

TEST(NoneEvidence, HoldsItsDefinitionWhereverADeadlineEndsIt) {
  NoneByBounds none(two_objects(), lattice_of(30, 30, 8));
  const Recording recording = random_recording(2, 36, 711);
  const std::vector<Touch> touches = all_touches(recording);
  none.add(touches);
  const LogInterval bounds =
      none.none.bounds([](const LogInterval& /*found*/) { return false; }, Deadline(1e-9));
  expect_holds(bounds, none.expected(touches), infinity);
  EXPECT_GT(bounds.high - bounds.low, 1e-3) << "there was no time";
  expect_holds(none.bounds(1e-6), none.expected(touches), 1e-6);
}

BoundedOptions with_none(double none_weight, int x = 13, int y = 12, int theta = 16) {
  BoundedOptions options = small_options();
  options.none_weight = none_weight;
  options.lattice.x_mm.count = x;
  options.lattice.y_mm.count = y;
  options.lattice.theta_rad.count = theta;
  return options;
}

Estimate estimate_of(const std::vector<Hypothesis>& objects, const BoundedOptions& options,
                     const Recording& recording) {
  BoundedPosterior posterior(objects, options);
  posterior.update(all_touches(recording));
  return posterior.estimate();
}

double none_width(const Estimate& estimate) {
  const LogInterval none = estimate.certificate->none_log_evidence.value();
  return none.high - none.low;
}

TEST(BoundedNone, AndTheMarginalsOfAllObjectsAreTheWhole) {
  BoundedPosterior posterior(two_shapes(), with_none(2.0));
  BoundedPosterior without(two_shapes(), small_options());
  for (BoundedPosterior* each : {&posterior, &without}) {
    each->update(all_touches(touches_of_l(4, 816)));
    EXPECT_NEAR(each->estimate().none + sum(each->marginals(0).xy) + sum(each->marginals(1).xy),
                1.0, 1e-12);
  }
  // Of each touch, every object and theta has at least some numbers.
  EXPECT_GT(posterior.host_bytes(),
            without.host_bytes() + std::size_t{4 * 2 * 16} * sizeof(double));
}

TEST(BoundedNone, IsBoundedAsCloselyAsTheEvidenceAndWithin0_3Nats) {
  struct Row {
    double weight;
    std::optional<double> evidence_nats;
    double least;  ///< width in nats
    double most;
  };
  for (const Row& row : {Row{1e-12, {}, 1e-4, infinity},  // which no identity asks for
                         Row{1e-12, 1e-4, 0.0, 1e-4}, Row{1.0, 0.01, 0.0, 0.01},
                         Row{1.0, 3.0, 0.0, 0.3}, Row{3.0, {}, 0.0, 0.3}}) {
    SCOPED_TRACE(testing::Message() << "weight " << row.weight);
    BoundedOptions options = with_none(row.weight, 30, 30);
    options.evidence_nats = row.evidence_nats;
    const Estimate estimate = estimate_of(two_made_up(), options, random_recording(1, 36, 820));
    EXPECT_GE(none_width(estimate), row.least);
    EXPECT_LE(none_width(estimate), row.most);
    const Certificate& certificate = estimate.certificate.value();
    const LogInterval none = *certificate.none_log_evidence;
    for (std::size_t i = 0; i < 2; ++i) {
      const auto [own_low, own_high] = certificate.log_evidence[i];
      const auto [other_low, other_high] = certificate.log_evidence[1 - i];
      const auto [low, high] = estimate.identity_bounds[i];
      EXPECT_LE(high - low, 0.3 / 4.0 + 4.0 * options.tolerance);
      // The least where all others have the most.
      EXPECT_LE(low, 1.0 / (1.0 + std::exp(log_add(other_high, none.high) - own_low)) + 1e-12);
      EXPECT_GE(high, 1.0 / (1.0 + std::exp(log_add(other_low, none.low) - own_high)) - 1e-12);
    }
  }
}

TEST(BoundedNone, ShowsInTheIdentitiesWhereABudgetLeftIt) {
  BoundedOptions options = with_none(3.0, 90, 90, 20);
  const Recording recording = random_recording(1, 36, 819);
  const Estimate all = estimate_of(two_made_up(), options, recording);
  options.budget_s = 1e-9;
  const Estimate some = estimate_of(two_made_up(), options, recording);
  EXPECT_GT(none_width(some), 1e-3);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_LE(some.identity_bounds[i].low, all.identity[i]);
    EXPECT_GE(some.identity_bounds[i].high, all.identity[i]);
  }
}

TEST(BoundedNone, KeepsItsPriorWhereABudgetToldNothing) {
  BoundedOptions options = with_none(1.0 / 3.0);  // beside weights of 1 and 2
  const Recording recording = touches_of_l(4, 821);
  EXPECT_LT(estimate_of(two_shapes(), options, recording).none, 0.01);
  options.budget_s = 1e-9;
  EXPECT_NEAR(estimate_of(two_shapes(), options, recording).none, 0.1, 1e-9);
}

TEST(BoundedNone, IsBelievedWhereASearchOfPoorFitsEndsEarly) {
  BoundedOptions options = with_none(1.0 / 3.0, 60, 60);
  options.poor_bins = 1;
  // Readings at random, which no pose explains.
  const Estimate estimate = estimate_of(two_shapes(), options, random_recording(6, 36, 829));
  EXPECT_GT(estimate.certificate->dropped_mass, 0.7) << "the search did not end early";
  EXPECT_GT(estimate.none, 0.99);
}

TEST(BoundedNone, LeavesObjectsAModeWhereItTakesAllOfTheMass) {
  const BoundedOptions options = with_none(1e300);
  BoundedPosterior posterior(two_made_up(), options);
  posterior.update(all_touches(random_recording(4, 36, 817)));
  const Estimate estimate = posterior.estimate();
  EXPECT_EQ(estimate.none, 1.0);
  EXPECT_GE(estimate.certificate->dropped_mass, 0.0);
  EXPECT_LE(estimate.certificate->dropped_mass, options.tolerance);
  EXPECT_TRUE(estimate.mode.bin.has_value());
  for (const double p : posterior.marginals(0).xy) {
    EXPECT_TRUE(p >= 0.0 && p <= 1e-200);
  }
}

}  // namespace palpate::none_evidence_test
