// The bounded posterior against the dense one, and the laws of its interface.

#include "palpate/bounded_posterior.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "bounded/certified.hpp"
#include "limits.hpp"
#include "palpate/error.hpp"
#include "palpate/pose_histogram.hpp"
#include "touched_shape.hpp"

namespace palpate::bounded_posterior_test {

const std::vector<Hypothesis>& two_shapes() {
  static const std::vector<Hypothesis> two{{map_of(on_letter_l, "L"), 1.0},
                                           {map_of(on_disc, "disc"), 2.0}};
  return two;
}

const std::vector<Hypothesis>& two_made_up() {
  static const std::vector<Hypothesis> two{{random_map(31, 27, 0.5, 3.0, 801), 1.0},
                                           {random_map(23, 29, 0.5, 3.0, 802), 3.0}};
  return two;
}

BoundedOptions small_options() {
  BoundedOptions options;
  options.lattice = {.x_mm = {-6.0, 6.0, 13},
                     .y_mm = {-5.0, 6.0, 12},
                     .theta_rad = {0, two_pi, 16},
                     .pivot_mm = {2.0, -1.0}};
  return options;
}

Recording touches_of_l(std::size_t touches, std::uint64_t seed) {
  return touches_of(on_letter_l, {{1.3, -0.8}, 0.7}, touches, seed);
}

void expect_refused(const std::function<void()>& call, const std::string& says) {
  try {
    call();
    ADD_FAILURE() << "accepted, in the place of: " << says;
  } catch (const Error& error) {
    const std::string message = error.what();
    EXPECT_EQ(error.fault(), Fault::input) << message;
    EXPECT_NE(message.find(says), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

TEST(BoundedPosterior, AgreesWithTheDenseHistogram) {
  Device device = Device::open();
  const Recording recording = touches_of_l(6, 803);
  for (const double gamma : {0.1, 0.0}) {
    for (const std::size_t touches : {0U, 1U, 2U, 6U}) {
      SCOPED_TRACE(::testing::Message() << touches << " touches, gamma " << gamma);
      BoundedOptions options = small_options();
      options.contact.gamma = gamma;
      BoundedPosterior bounded(device, two_shapes(), options);
      PoseHistogram dense(device, two_shapes(),
                          {.lattice = options.lattice, .contact = options.contact});
      bounded.update(recording.touches(0, touches));
      dense.update(recording.touches(0, touches));
      const Estimate ours = bounded.estimate();
      const Estimate theirs = dense.estimate();
      // The dense engine's rounding: 1e-4 nats per touch, of which a float32 sum's 2e-6 remains
      // where nothing was touched; gamma = 0 makes it relative, of at most 300 nats a touch.
      const double nats = per_touch * static_cast<double>(touches);
      const double allowed = options.tolerance + 2e-6 + 2.0 * nats;
      for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_NEAR(ours.identity[i], theirs.identity[i], allowed);
        const Marginals a = bounded.marginals(static_cast<int>(i));
        const Marginals b = dense.marginals(static_cast<int>(i));
        EXPECT_LE(largest_difference(a.xy, b.xy), allowed);
        EXPECT_LE(largest_difference(a.theta, b.theta), allowed);
      }
      EXPECT_NEAR(ours.mode.log_likelihood, theirs.mode.log_likelihood, nats);
      EXPECT_EQ(ours.contradicted, theirs.contradicted);
      if (touches == 6) {  // fewer leave ties
        EXPECT_EQ(ours.mode.object, theirs.mode.object);
        EXPECT_EQ(ours.mode.bin, theirs.mode.bin);
        EXPECT_EQ(ours.mode.T_object_robot.theta_rad, theirs.mode.T_object_robot.theta_rad);
      }
      const RefinedPose a = bounded.refine(theirs.mode);
      const RefinedPose b = dense.refine(theirs.mode);
      // Logs that are 1e-4 nats off per touch move a mean within 2.5 mm by at most some 1e-3 mm.
      EXPECT_NEAR(a.T_object_robot.translation_mm.x, b.T_object_robot.translation_mm.x, 1e-3);
      EXPECT_NEAR(a.T_object_robot.translation_mm.y, b.T_object_robot.translation_mm.y, 1e-3);
      EXPECT_NEAR(a.T_object_robot.theta_rad, b.T_object_robot.theta_rad, 1e-3);
      for (std::size_t k = 0; k < 9; ++k) {
        EXPECT_NEAR(a.covariance[k], b.covariance[k],
                    1e-9 + 1e-3 * std::max(b.covariance[4 * (k / 3)], b.covariance[4 * (k % 3)]));
      }
    }
  }
}

TEST(BoundedPosterior, BeforeAnyTouchKnowsTheWeights) {
  Device device = Device::open();
  BoundedPosterior posterior(device, two_made_up(), small_options());
  const Estimate estimate = posterior.estimate();
  EXPECT_NEAR(estimate.identity[0], 0.25, 1e-12);
  EXPECT_NEAR(estimate.identity[1], 0.75, 1e-12);
  EXPECT_EQ(estimate.mode.log_likelihood, 0.0);
  EXPECT_FALSE(estimate.contradicted);
  expect_certified(device, two_made_up(), small_options(), {});
}

TEST(BoundedPosterior, TellsTheLogLikelihoodOfPosesOffTheLattice) {
  Device device = Device::open();
  const Recording recording = random_recording(4, 36, 804);
  BoundedPosterior posterior(device, two_made_up(), small_options());
  posterior.update(all_touches(recording));
  Uniform random(805);
  for (int i = 0; i < 100; ++i) {
    const Pose pose{{random(-40.0, 40.0), random(-40.0, 40.0)}, random(-9.0, 9.0)};
    const int object = i % 2;
    double expected = 0.0;
    for (const Touch& touch : all_touches(recording)) {
      expected += reference::log_likelihood(touch, pose, two_made_up()[i % 2].map, {});
    }
    EXPECT_NEAR(posterior.log_likelihood(object, pose), expected, 1e-10) << "rounding of 144 terms";
  }
  expect_refused([&] { posterior.log_likelihood(2, {}); }, "object 2");
  expect_refused([&] { posterior.log_likelihood(-1, {}); }, "object -1");
  expect_refused([&] { posterior.log_likelihood(0, {{nan, 0.0}, 0.0}); }, "finite");
}

TEST(BoundedPosterior, TellsMarginalsOnAnyGrid) {
  Device device = Device::open();
  const Recording recording = touches_of_l(2, 806);
  const BoundedOptions options = small_options();
  BoundedPosterior posterior(device, two_shapes(), options);
  posterior.update(all_touches(recording));
  const reference::Posterior truth =
      reference_posterior(two_shapes(), options, all_touches(recording));
  const Certificate certificate = posterior.estimate().certificate.value();
  // Coarser, and over a part of the region: what lies outside counts at its border.
  const PoseLattice grid{.x_mm = {-4.0, 6.0, 3},
                         .y_mm = {-6.0, 6.0, 2},
                         .theta_rad = {0, two_pi, 4},
                         .pivot_mm = options.lattice.pivot_mm};
  const double log_total = [&] {
    double sum = 0.0;
    for (std::size_t i = 0; i < 2; ++i) {
      for (const double l : truth.log_likelihood[i]) {
        sum += truth.weight[i] * std::exp(l);
      }
    }
    return std::log(sum);
  }();
  for (int object = 0; object < 2; ++object) {
    const auto i = static_cast<std::size_t>(object);
    std::vector<double> xy(6, 0.0);
    std::vector<double> theta(4, 0.0);
    for (std::size_t bin = 0; bin < truth.log_likelihood[i].size(); ++bin) {
      const double p =
          std::exp(std::log(truth.weight[i]) + truth.log_likelihood[i][bin] - log_total);
      const std::int64_t at =
          grid.bin_of(reference::bin_pose(options.lattice, static_cast<std::int64_t>(bin)));
      xy[static_cast<std::size_t>(at % 6)] += p;
      theta[static_cast<std::size_t>(at / 6)] += p;
    }
    const Marginals marginals = posterior.marginals(object, grid);
    EXPECT_EQ(marginals.grid.x_mm.count, 3);
    EXPECT_LE(largest_difference(marginals.xy, xy), certificate.dropped_mass + 1e-9);
    EXPECT_LE(largest_difference(marginals.theta, theta), certificate.dropped_mass + 1e-9);
  }
  expect_refused([&] { posterior.marginals(2); }, "object 2");
  PoseLattice reversed = grid;
  reversed.x_mm = {1.0, -1.0, 3};
  expect_refused([&] { posterior.marginals(0, reversed); }, "reversed");
}

TEST(BoundedPosterior, DoesNotDependOnTheOrderOfTouchesNorOnWhenOneAsked) {
  Device device = Device::open();
  for (const bool none : {false, true}) {
    BoundedOptions options = small_options();
    if (none) {
      options.none_weight = 0.5;
    }
    const Recording recording = touches_of_l(5, 807);
    const std::vector<Touch> touches = all_touches(recording);
    BoundedPosterior at_once(device, two_shapes(), options);
    at_once.update(touches);
    const auto expected = told_by(at_once, 2);
    EXPECT_EQ(told_by(at_once, 2), expected) << "asked again";

    BoundedPosterior one_by_one(device, two_shapes(), options);
    for (const Touch& touch : touches) {
      one_by_one.estimate();
      one_by_one.update(touch);
      one_by_one.marginals(0);
    }
    EXPECT_EQ(told_by(one_by_one, 2), expected);

    // The first touch stays the first: the share of "none of these" is the first one's.
    for (const std::vector<std::size_t>& order :
         {std::vector<std::size_t>{0, 4, 3, 2, 1}, {0, 2, 4, 1, 3}}) {
      BoundedPosterior other(device, two_shapes(), options);
      other.update(touches[order[0]]);
      other.update(std::vector{touches[order[1]], touches[order[2]]});
      other.estimate();
      other.update(std::vector{touches[order[3]], touches[order[4]]});
      EXPECT_EQ(told_by(other, 2), expected);
    }
  }
}

TEST(BoundedPosterior, AfterAResetIsANewOne) {
  Device device = Device::open();
  BoundedOptions options = small_options();
  options.none_weight = 0.5;
  const Recording before = random_recording(3, 20, 808);
  const Recording recording = touches_of_l(3, 809);
  BoundedPosterior fresh(device, two_shapes(), options);
  const auto untouched = told_by(fresh, 2);
  fresh.update(all_touches(recording));
  BoundedPosterior used(device, two_shapes(), options);
  used.update(all_touches(before));
  used.estimate();
  used.reset();
  EXPECT_EQ(told_by(used, 2), untouched);
  used.update(all_touches(before));
  used.reset();
  used.update(all_touches(recording));
  EXPECT_EQ(told_by(used, 2), told_by(fresh, 2));
  EXPECT_NE(told_by(used, 2), untouched);
}

TEST(BoundedPosterior, TakesInAllTouchesOrNone) {
  Device device = Device::open();
  BoundedOptions options = small_options();
  options.none_weight = 0.5;
  Recording recording = touches_of_l(4, 810);
  const std::vector<Touch> sound = recording.touches(0, 3);
  recording.T_robot_sensor[3].translation_mm.x = nan;
  const std::vector<Touch> touches = all_touches(recording);
  BoundedPosterior posterior(device, two_shapes(), options);
  posterior.update(touches[0]);
  const auto before = told_by(posterior, 2);
  expect_refused([&] { posterior.update(touches); }, "T_robot_sensor is not finite");
  EXPECT_EQ(told_by(posterior, 2), before);
  // Broken off at the first call of `progress`, and at the last one.
  int calls = 0;
  BoundedPosterior(device, two_shapes(), options).update(sound, [&](double done) {
    EXPECT_GT(done, 0.0);
    EXPECT_LE(done, 1.0);
    ++calls;
  });
  ASSERT_GT(calls, 0);
  for (const int last : {1, calls}) {
    int call = 0;
    EXPECT_THROW(posterior.update(std::span(sound).subspan(1),
                                  [&](double) {
                                    if (++call >= last || call >= 1 + last / 2) {
                                      throw std::runtime_error("broken off");
                                    }
                                  }),
                 std::runtime_error);
    EXPECT_EQ(told_by(posterior, 2), before);
  }
  posterior.update(std::span(sound).subspan(1));
  BoundedPosterior other(device, two_shapes(), options);
  other.update(sound);
  EXPECT_EQ(told_by(posterior, 2), told_by(other, 2)) << "as if nothing had been refused";
}

TEST(BoundedPosterior, HasTheSameBitsWithoutADevice) {
  Device device = Device::open();
  const Recording recording = touches_of_l(3, 811);
  const std::vector<Touch> touches = all_touches(recording);
  BoundedPosterior with(device, two_shapes(), small_options());
  BoundedPosterior without(two_shapes(), small_options());
  with.update(touches);
  without.update(touches);
  EXPECT_EQ(told_by(without, 2), told_by(with, 2));
  EXPECT_NE(without.path().find("on the host"), std::string::npos) << without.path();
}

TEST(BoundedPosterior, HasTheSameBitsOnAnyNumberOfThreads) {
  // More threads than the machine may have cores.
  const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 4);
  Device device = Device::open();
  const Recording recording = touches_of_l(3, 811);
  std::vector<std::vector<double>> one;
  for (const int threads : {1, 4, 0, 3}) {
    BoundedOptions options = small_options();
    options.none_weight = 0.5;
    options.threads = threads;
    BoundedPosterior posterior(device, two_shapes(), options);
    for (const Touch& touch : all_touches(recording)) {
      posterior.update(touch);
      posterior.estimate();
    }
    const auto told = told_by(posterior, 2);
    if (one.empty()) {
      one = told;
    }
    EXPECT_EQ(told, one) << threads << " threads";
  }
}

TEST(BoundedPosterior, GivesTheSameAfterACancelledSearchAsWithoutOne) {
  Device device = Device::open();
  const Recording recording = touches_of_l(2, 813);
  struct Cancelled {};
  for (const std::optional<double> budget_s : {std::optional<double>(), std::optional(1e3)}) {
    BoundedOptions options = small_options();
    options.budget_s = budget_s;
    BoundedPosterior expected(device, two_shapes(), options);
    expected.update(recording.touches(0, 2));
    int left = -1;  // cancel points until one throws; never below 0
    int passed = 0;
    options.cancel_point = [&] {
      ++passed;
      if (left >= 0 && left-- == 0) {
        throw Cancelled();
      }
    };
    BoundedPosterior posterior(device, two_shapes(), options);
    const auto cancelled_after = [&](int points, const auto& call) {
      left = points;
      EXPECT_THROW(call(), Cancelled) << points;
      left = -1;
    };
    posterior.update(recording.touches(0, 2));
    passed = 0;
    posterior.estimate();
    const int points = passed;
    EXPECT_GT(points, 2);
    for (int i = 0; i < points; ++i) {
      posterior.reset();
      posterior.update(recording.touches(0, 2));
      cancelled_after(i, [&] { posterior.estimate(); });
      EXPECT_EQ(told_by(posterior, 2), told_by(expected, 2)) << i;
    }
    // Every call that searches can be cancelled.
    posterior.reset();
    posterior.update(recording.touches(0, 2));
    cancelled_after(0, [&] { posterior.marginals(0); });
    cancelled_after(0, [&] { posterior.entropy(); });
    cancelled_after(0, [&] { posterior.sample(3, 1); });
    cancelled_after(0, [&] { posterior.refined_blocks(); });
    EXPECT_EQ(posterior.entropy(), expected.entropy());
  }
}

TEST(BoundedPosterior, MovesItsPivotOnlyBeforeATouch) {
  Device device = Device::open();
  const Recording recording = touches_of_l(2, 812);
  BoundedOptions options = small_options();
  options.none_weight = 0.5;
  BoundedPosterior moved(device, two_shapes(), options);
  moved.estimate();
  moved.move_pivot({-3.0, 4.0});
  options.lattice.pivot_mm = {-3.0, 4.0};
  BoundedPosterior made(device, two_shapes(), options);
  EXPECT_EQ(told_by(moved, 2), told_by(made, 2));
  moved.update(all_touches(recording));
  made.update(all_touches(recording));
  const auto told = told_by(made, 2);
  EXPECT_EQ(told_by(moved, 2), told);
  expect_refused([&] { moved.move_pivot({1.0, 1.0}); }, "call reset() before the pivot moves");
  EXPECT_EQ(told_by(moved, 2), told);
  moved.reset();
  expect_refused([&] { moved.move_pivot({nan, 0.0}); }, "pivot_mm");
  moved.update(all_touches(recording));
  EXPECT_EQ(told_by(moved, 2), told) << "the pivot stays over reset()";
}

// Asked on purpose, each of them. NOLINTBEGIN(bugprone-use-after-move)
TEST(BoundedPosterior, SaysThatItWasMovedFrom) {
  Device device = Device::open();
  const Recording recording = random_recording(1, 36, 813);
  BoundedPosterior first(device, two_made_up(), small_options());
  BoundedPosterior second(std::move(first));
  second.update(recording.touch(0));
  for (const auto& call : std::vector<std::function<void()>>{
           [&] { first.reset(); }, [&] { first.move_pivot({}); },
           [&] { first.update(recording.touch(0)); }, [&] { first.estimate(); },
           [&] { first.refine({}); }, [&] { first.marginals(0); },
           [&] { first.marginals(0, small_options().lattice); },
           [&] { first.log_likelihood(0, {}); }, [&] { first.entropy(); },
           [&] { first.sample(1, 1); }, [&] { first.lattice(); }, [&] { first.path(); },
           [&] { first.host_bytes(); }}) {
    expect_refused(call, "bounded posterior: was moved from");
  }
  first = std::move(second);
  EXPECT_NE(first.estimate().mode.log_likelihood, 0.0);
}
// NOLINTEND(bugprone-use-after-move)

TEST(BoundedPosterior, RefusesWhatItCannotDo) {
  Device device = Device::open();
  const auto refuse = [&](const std::function<void(BoundedOptions&)>& change,
                          const std::string& says) {
    BoundedOptions options = small_options();
    change(options);
    expect_refused([&] { BoundedPosterior(device, two_made_up(), options); }, says);
  };
  for (const double tolerance : {0.0, -1e-6, 1.0, 2.0, nan, infinity}) {
    refuse([&](BoundedOptions& o) { o.tolerance = tolerance; }, "tolerance");
  }
  for (const double number : {0.0, -1.0, nan, infinity}) {
    refuse([&](BoundedOptions& o) { o.budget_s = number; }, "budget");
    refuse([&](BoundedOptions& o) { o.evidence_nats = number; }, "evidence_nats");
    refuse([&](BoundedOptions& o) { o.none_weight = number; }, "none_weight");
  }
  for (const double number : {-0.1, nan, infinity}) {
    refuse([&](BoundedOptions& o) { o.evidence_growth = number; }, "evidence_growth");
  }
  refuse([&](BoundedOptions& o) { o.threads = -1; }, "threads");
  refuse([&](BoundedOptions& o) { o.lattice.x_mm.count = 0; }, "bins x_mm");
  refuse([&](BoundedOptions& o) { o.contact.gamma = 1.0; }, "gamma");
  expect_refused([&] { BoundedPosterior(device, {}, small_options()); }, "give at least one map");
  std::vector<Hypothesis> objects = two_made_up();
  objects[1].weight = 0.0;
  expect_refused([&] { BoundedPosterior(device, objects, small_options()); }, "weight");
  objects = two_made_up();
  objects[1].map.prior = 0.4;
  expect_refused([&] { BoundedPosterior(device, objects, small_options()); }, "prior");
  BoundedPosterior posterior(device, two_made_up(), small_options());
  expect_refused([&] { posterior.refine({.object = 2}); }, "object 2");
  expect_refused([&] { posterior.refine({.object = 0, .bin = 1'000'000}); }, "bin");
}

/// Elements in contact where all cells of a map have the same log odds.
struct Contradiction {
  int side = 0;           ///< of the square of elements
  float heavy = 0.0F;     ///< log odds that contradict the touch by more than 700 nats
  float light = 0.0F;     ///< log odds that contradict it by less
  float as_heavy = 0.0F;  ///< log odds that contradict it by more than 700 nats, too
};

TEST(BoundedPosterior, IsContradictedWhereTheDenseOneIs) {
  Device device = Device::open();
  // By few elements beyond what a tile's penalties hold, and by many within it.
  for (const Contradiction& by :
       {Contradiction{2, -500.0F, -150.0F, -400.0F}, Contradiction{9, -12.0F, -8.0F, -11.0F}}) {
    std::vector<Hypothesis> objects{{random_map(61, 61, 0.5, 1.0, 814), 1.0},
                                    {random_map(61, 61, 0.5, 1.0, 815), 1.0}};
    const auto fill = [&](std::size_t object, float log_odds) {
      std::vector<float>& cells = objects[object].map.log_odds;
      std::fill(cells.begin(), cells.end(), log_odds);
    };
    Recording recording;
    for (int i = 0; i < by.side * by.side; ++i) {
      recording.elements_mm.emplace_back(0.2 * (i % by.side), 0.2 * (i / by.side));
      recording.pressure.push_back(9.0);
    }
    recording.T_robot_sensor = {{}};
    BoundedOptions options = small_options();
    options.contact.gamma = 0.0;
    for (const double weight : {1.0, 1e-300}) {
      SCOPED_TRACE(::testing::Message() << by.side << " elements a side, weight " << weight);
      objects[1].weight = weight;
      const auto compare = [&](float light, bool contradicted) {
        fill(0, by.heavy);
        fill(1, light);
        BoundedPosterior bounded(device, objects, options);
        PoseHistogram dense(device, objects,
                            {.lattice = options.lattice, .contact = options.contact});
        bounded.update(all_touches(recording));
        dense.update(all_touches(recording));
        EXPECT_EQ(dense.estimate().contradicted, contradicted);
        EXPECT_EQ(bounded.estimate().contradicted, contradicted);
        EXPECT_EQ(bounded.estimate().mode.object, dense.estimate().mode.object);
      };
      compare(by.light, false);
      compare(by.as_heavy, true);
    }
  }
}

double sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

TEST(BoundedPosterior, KnowsNoneOfThese) {
  Device device = Device::open();
  const Recording recording = touches_of_l(4, 816);
  BoundedOptions options = small_options();
  options.none_weight = 2.0;
  BoundedPosterior bounded(device, two_shapes(), options);
  PoseHistogram dense(device, two_shapes(), {.lattice = options.lattice, .none_weight = 2.0});
  EXPECT_NEAR(bounded.estimate().none, 0.4, 1e-12) << "2 of 1 + 2 + 2";
  for (std::size_t n = 1; n <= recording.size(); ++n) {
    bounded.update(recording.touch(n - 1));
    dense.update(recording.touch(n - 1));
    const Estimate ours = bounded.estimate();
    const Estimate theirs = dense.estimate();
    // 1e-3 nats per touch is what the method allows a float32 mean.
    EXPECT_NEAR(std::log(ours.none / (1.0 - ours.none)),
                std::log(theirs.none / (1.0 - theirs.none)), 1e-3 * static_cast<double>(n));
    EXPECT_NEAR(sum(ours.identity) + ours.none, 1.0, 1e-12);
    double marginals = ours.none;
    for (int i = 0; i < 2; ++i) {
      marginals += sum(bounded.marginals(i).xy);
      const auto [low, high] = ours.identity_bounds[static_cast<std::size_t>(i)];
      EXPECT_LE(low, ours.identity[static_cast<std::size_t>(i)]);
      EXPECT_GE(high, ours.identity[static_cast<std::size_t>(i)]);
    }
    EXPECT_NEAR(marginals, 1.0, 1e-12);
    // Its odds against an object lie between those of the bounds of both their evidence.
    const auto [least, most] = ours.certificate->log_evidence[0];
    const auto [none_least, none_most] = ours.certificate->none_log_evidence.value();
    const double against = std::log(ours.identity[0]) - std::log(ours.none);
    EXPECT_GE(against, least - none_most - 1e-12);
    EXPECT_LE(against, most - none_least + 1e-12);
  }
  options.none_weight.reset();
  BoundedPosterior without(device, two_shapes(), options);
  without.update(all_touches(recording));
  const Estimate expected = without.estimate();
  const Estimate with = bounded.estimate();
  EXPECT_FALSE(expected.certificate->none_log_evidence);
  EXPECT_EQ(expected.none, 0.0);
  EXPECT_EQ(with.mode.bin, expected.mode.bin);
  EXPECT_NEAR(with.identity[0] / sum(with.identity), expected.identity[0], 2.0 * options.tolerance);
}

TEST(BoundedPosterior, BoundsNoneOfTheseBeyondAHundredThousandBins) {
  Device device = Device::open();
  BoundedOptions options = small_options();
  options.lattice.x_mm.count = 90;
  options.lattice.y_mm.count = 90;
  options.lattice.theta_rad.count = 20;
  options.none_weight = 3.0;
  for (const std::size_t elements : {36, 200}) {
    const Recording recording = random_recording(3, elements, 818);
    BoundedPosterior bounded(device, two_made_up(), options);
    PoseHistogram dense(device, two_made_up(), {.lattice = options.lattice, .none_weight = 3.0});
    for (std::size_t n = 1; n <= recording.size(); ++n) {
      SCOPED_TRACE(testing::Message() << elements << " elements, touch " << n);
      bounded.update(recording.touch(n - 1));
      dense.update(recording.touch(n - 1));
      const Estimate ours = bounded.estimate();
      const Estimate theirs = dense.estimate();
      // Shares of "none of these" that are near 1 leave the objects' digits.
      const double share = *ours.none_log_evidence - ours.log_evidence[0];
      const double expected = *theirs.none_log_evidence - theirs.log_evidence[0];
      // Its first bounds are 0.01 nats wide; float32 allows 1e-3.
      EXPECT_NEAR(share, expected, 0.008 * static_cast<double>(n));
      const auto [low, high] = ours.certificate->none_log_evidence.value();
      EXPECT_LE(low, *ours.none_log_evidence);
      EXPECT_GE(high, *ours.none_log_evidence);
      for (std::size_t i = 0; i < 2; ++i) {
        const ProbabilityInterval& p = ours.identity_bounds[i];
        EXPECT_LE(p.high - p.low, 4.0 * options.tolerance)
            << "of none, of this one and of the other";
      }
    }
  }
}

TEST(BoundedPosterior, BoundsNoneOfTheseAsCloselyAsTheEvidenceIsAskedFor) {
  Device device = Device::open();
  BoundedOptions options = small_options();
  options.none_weight = 1e-12;  // which no identity would ask for
  BoundedPosterior plain(device, two_made_up(), options);
  options.evidence_nats = 1e-4;
  BoundedPosterior close(device, two_made_up(), options);
  const auto width_of = [](const BoundedPosterior& posterior) {
    const LogInterval none = posterior.estimate().certificate->none_log_evidence.value();
    return none.high - none.low;
  };
  const Recording recording = random_recording(1, 36, 820);
  plain.update(all_touches(recording));
  close.update(all_touches(recording));
  EXPECT_GT(width_of(plain), 1e-4);
  EXPECT_LE(width_of(close), 1e-4);
}

TEST(BoundedPosterior, ShowsInTheIdentitiesWhereABudgetLeftNoneOfThese) {
  Device device = Device::open();
  BoundedOptions options = small_options();
  options.lattice.x_mm.count = 90;
  options.lattice.y_mm.count = 90;
  options.lattice.theta_rad.count = 20;
  options.none_weight = 3.0;
  BoundedPosterior sharp(device, two_made_up(), options);
  options.budget_s = 1e-9;
  BoundedPosterior ended(device, two_made_up(), options);
  const Recording recording = random_recording(1, 36, 819);
  sharp.update(all_touches(recording));
  ended.update(all_touches(recording));
  const Estimate all = sharp.estimate();
  const Estimate some = ended.estimate();
  EXPECT_GT(some.certificate->none_log_evidence->high - some.certificate->none_log_evidence->low,
            1e-3);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_LE(some.identity_bounds[i].low, all.identity[i]);
    EXPECT_GE(some.identity_bounds[i].high, all.identity[i]);
  }
}

TEST(BoundedPosterior, LeavesObjectsWhereNoneTakesAllOfTheMass) {
  Device device = Device::open();
  const Recording recording = random_recording(4, 36, 817);
  BoundedOptions options = small_options();
  options.none_weight = 1e300;
  BoundedPosterior posterior(device, two_made_up(), options);
  posterior.update(all_touches(recording));
  const Estimate estimate = posterior.estimate();
  EXPECT_EQ(estimate.none, 1.0);
  EXPECT_GE(estimate.certificate->dropped_mass, 0.0);
  EXPECT_LE(estimate.certificate->dropped_mass, options.tolerance);
  EXPECT_TRUE(estimate.mode.bin.has_value());
  for (const double p : posterior.marginals(0).xy) {
    EXPECT_TRUE(p >= 0.0 && p <= 1e-200);
  }
}

}  // namespace palpate::bounded_posterior_test
