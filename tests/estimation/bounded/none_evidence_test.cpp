// "None of these" by bounds, against its definition over all bins in float64.

#include "estimation/bounded/none_evidence.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "bins_by_definition.hpp"
#include "estimation/hypotheses.hpp"
#include "support/limits.hpp"
#include "support/sanitized.hpp"
#include "support/synthetic.hpp"

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
  LogInterval bounds_of(std::span<const Touch> touches, double width_nats = first_width) {
    none.reset();
    add(touches);
    return bounds(width_nats);
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

void expect_holds(const LogInterval& bounds, double value, double width_nats) {
  EXPECT_LE(bounds.low, value + rounding);
  EXPECT_GE(bounds.high, value - rounding);
  EXPECT_LE(bounds.high - bounds.low, width_nats);
}

PoseLattice small_lattice() {
  return {.x_mm = {-15.0, 16.0, 21},
          .y_mm = {-14.0, 15.0, 19},
          .theta_rad = {0, two_pi, 8},
          .pivot_mm = {3.0, -2.0}};
}

PoseLattice lattice_of(int x, int y, int theta) {
  PoseLattice lattice = small_lattice();
  lattice.x_mm.count = x;
  lattice.y_mm.count = y;
  lattice.theta_rad.count = theta;
  return lattice;
}

TEST(NoneEvidence, HoldsItsDefinition) {
  ContactModel rarely_wrong;
  rarely_wrong.gamma = 0.01;
  ContactModel never_wrong;
  never_wrong.gamma = 0.0;
  ContactModel learned;
  learned.prior = 0.2;
  learned.table = crooked_table();
  std::uint64_t seed = 703;
  for (const ContactModel& contact : {ContactModel{}, rarely_wrong, never_wrong, learned}) {
    for (const PoseLattice& lattice :
         {small_lattice(), lattice_of(60, 3, 12), lattice_of(9, 80, 5)}) {
      NoneByBounds none(two_objects(), lattice, contact);
      EXPECT_EQ(none.bounds().high, 0.0);
      for (const std::size_t elements : {8, 36, 150}) {
        if (elements == 150 && (sanitized || lattice.theta_rad.count != 5)) {
          continue;  // takes long
        }
        SCOPED_TRACE(fmt::format("{} elements, seed {}", elements, ++seed));
        const Recording recording = random_recording(1, elements, seed);
        const std::vector<Touch> touches = all_touches(recording);
        const double expected = none.expected(touches);
        expect_holds(none.bounds_of(touches), expected, first_width);
        // The table is so steep that its float64 rounding may be more.
        double error = 0.0;
        for (const Touch& touch : touches) {
          const KnownElements known =
              known_elements(TouchEvidence(touch, none.options.contact), none.options);
          error += std::max(none.likelihood.error(0, known), none.likelihood.error(1, known));
        }
        expect_holds(none.bounds(1e-6), expected, std::max(1e-6, 2.5 * error));
      }
    }
  }
}

TEST(NoneEvidence, LeavesOutThatTouchesAreDisplaced) {
  const Recording recording = random_recording(2, 36, 720);
  const std::vector<Touch> touches = all_touches(recording);
  for (const DisplacementSd& sd : {DisplacementSd{2.0, 0.33}, DisplacementSd{0.0, 0.3}}) {
    NoneByBounds displaced(two_objects(), lattice_of(19, 17, 20), {}, sd);
    expect_holds(displaced.bounds_of(touches), displaced.expected(touches), first_width);
    expect_holds(displaced.bounds(1e-6), displaced.expected(touches), 1e-6);
  }
}

TEST(NoneEvidence, HearsALightObjectThatAloneExplainsTheTouch) {
  // Only the light object is full; a press of 12 elements is worth 0.08^-12 of likelihood there.
  std::vector<Hypothesis> objects = two_objects();
  for (float& l : objects[0].map.log_odds) {
    l = -8.0F;
  }
  objects[0].map.log_odds[0] = 0.1F;  // so that its box holds the whole map
  objects[0].map.log_odds.back() = 0.1F;
  for (float& l : objects[1].map.log_odds) {
    l = 8.0F;
  }
  objects[1].weight = 1e-6;
  NoneByBounds none(objects, lattice_of(30, 30, 10));
  Recording recording = random_recording(1, 12, 705);
  for (std::size_t i = 0; i < 12; ++i) {
    recording.elements_mm[i] *= 0.2;
    recording.pressure[i] = 10.0;
  }
  const std::vector<Touch> touches = all_touches(recording);
  expect_holds(none.bounds_of(touches), none.expected(touches), first_width);
}

TEST(NoneEvidence, CountsAllBinsWhereTheArrayMeetsNoObject) {
  for (const PoseLattice& lattice : {small_lattice(), lattice_of(40, 30, 5)}) {
    NoneByBounds none(two_objects(), lattice);
    Recording recording = random_recording(2, 8, 706);
    recording.T_robot_sensor[0].translation_mm += glm::dvec2(200.0, 0.0);
    const std::vector<Touch> touches = all_touches(recording);
    // Every bin sees nothing but the prior, and s is 1: it counts once, at the first touch.
    expect_holds(none.bounds_of(std::span(touches).first(1)),
                 none.expected(std::span(touches).first(1)), 1e-9);
    expect_holds(none.bounds_of(touches), none.expected(touches), first_width);
  }
}

TEST(NoneEvidence, IsDeafToATouchWithoutAKnownElement) {
  NoneByBounds none(two_objects(), small_lattice());
  const Recording recording = random_recording(2, 8, 707);
  const std::vector<std::uint8_t> dead(8, 0);
  Touch silent = recording.touch(1);
  silent.valid = dead;
  EXPECT_EQ(none.bounds_of(std::vector{silent}).high, 0.0);
  const LogInterval with = none.bounds_of(std::vector{silent, recording.touch(0), silent});
  const LogInterval without = none.bounds_of(std::vector{recording.touch(0)});
  EXPECT_EQ(with.low, without.low);
  EXPECT_EQ(with.high, without.high);
}

TEST(NoneEvidence, OfOneBin) {
  for (const double x : {0.0, 30.0}) {
    const PoseLattice bin{.x_mm = {x, x, 1}, .y_mm = {0.5, 0.5, 1}, .theta_rad = {0.4, 0.4, 1}};
    NoneByBounds none(two_objects(), bin);
    const Recording recording = random_recording(3, 8, 708);
    const std::vector<Touch> touches = all_touches(recording);
    expect_holds(none.bounds_of(touches, 1e-8), none.expected(touches), 1e-8);
  }
}

TEST(NoneEvidence, DoesNotDependOnTheOrderButForTheFirstShare) {
  const Recording recording = random_recording(4, 8, 709);
  std::vector<Touch> touches = all_touches(recording);
  touches.push_back(touches[1]);  // one comes twice
  NoneByBounds none(two_objects(), lattice_of(30, 30, 8));
  const LogInterval forth = none.bounds_of(touches);
  std::vector<Touch> reversed(touches.rbegin(), touches.rend());
  std::swap(reversed.back(), reversed.front());  // the first stays the first
  const LogInterval back = none.bounds_of(reversed);
  EXPECT_EQ(forth.low, back.low);
  EXPECT_EQ(forth.high, back.high);
  std::swap(reversed.back(), reversed.front());
  expect_holds(none.bounds_of(reversed), none.expected(reversed), first_width);
}

TEST(NoneEvidence, HasTheSameBitsOnAnyNumberOfThreads) {
  // More threads than the machine may have cores.
  const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 4);
  const Recording recording = random_recording(2, 36, 710);
  const std::vector<Touch> touches = all_touches(recording);
  NoneByBounds none(two_objects(), lattice_of(30, 30, 8));
  const LogInterval told = none.bounds_of(touches);
  for (const int threads : {1, 2, 4}) {
    const LogInterval bounds =
        tbb::task_arena(threads).execute([&] { return none.bounds_of(touches); });
    EXPECT_EQ(bounds.low, told.low) << threads;
    EXPECT_EQ(bounds.high, told.high) << threads;
  }
}

TEST(MeanSearch, FindsTheSameWhereItHasNoRoomForSums) {
  NoneByBounds none(two_objects(), lattice_of(30, 30, 8));
  const Recording recording = random_recording(1, 36, 712);
  const TouchEvidence touch(recording.touch(0), none.options.contact);
  const KnownElements known = known_elements(touch, none.options);
  MeanSearch keeping(none.space, none.options, none.likelihood, touch, known, std::size_t{1} << 20);
  MeanSearch forgetting(none.space, none.options, none.likelihood, touch, known, 0);
  double least = infinity;
  for (int search = 0; search < 3; ++search) {
    const LogInterval kept = keeping.bounds(least, Deadline({})).value();
    const LogInterval found = forgetting.bounds(least, Deadline({})).value();
    EXPECT_EQ(kept.low, found.low) << search;
    EXPECT_EQ(kept.high, found.high) << search;
    least = kept.high - 4.0;
  }
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

}  // namespace palpate::none_evidence_test
