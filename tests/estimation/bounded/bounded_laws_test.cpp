// The laws of the bounded posterior's interface.

#include <cmath>
#include <functional>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "bounded_set_up.hpp"
#include "palpate/bounded_posterior.hpp"
#include "support/certified.hpp"

namespace palpate::bounded_laws_test {

TEST(BoundedPosterior, DoesNotDependOnTheOrderOfTouchesNorOnWhenOneAsked) {
  for (const bool none : {false, true}) {
    BoundedOptions options = small_options();
    if (none) {
      options.none_weight = 0.5;
    }
    const Recording recording = touches_of_l(5, 807);
    const std::vector<Touch> touches = all_touches(recording);
    BoundedPosterior at_once(two_shapes(), options);
    at_once.update(touches);
    const auto expected = told_by(at_once, 2);
    EXPECT_EQ(told_by(at_once, 2), expected) << "asked again";

    BoundedPosterior one_by_one(two_shapes(), options);
    for (const Touch& touch : touches) {
      one_by_one.estimate();
      one_by_one.update(touch);
      one_by_one.marginals(0);
    }
    EXPECT_EQ(told_by(one_by_one, 2), expected);

    // The first touch stays the first: the share of "none of these" is the first one's.
    for (const std::vector<std::size_t>& order :
         {std::vector<std::size_t>{0, 4, 3, 2, 1}, {0, 2, 4, 1, 3}}) {
      BoundedPosterior other(two_shapes(), options);
      other.update(touches[order[0]]);
      other.update(std::vector{touches[order[1]], touches[order[2]]});
      other.estimate();
      other.update(std::vector{touches[order[3]], touches[order[4]]});
      EXPECT_EQ(told_by(other, 2), expected);
    }
  }
}

TEST(BoundedPosterior, AfterAResetIsANewOne) {
  BoundedOptions options = small_options();
  options.none_weight = 0.5;
  const Recording before = random_recording(3, 20, 808);
  const Recording recording = touches_of_l(3, 809);
  BoundedPosterior fresh(two_shapes(), options);
  const auto untouched = told_by(fresh, 2);
  fresh.update(all_touches(recording));
  BoundedPosterior used(two_shapes(), options);
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
  BoundedOptions options = small_options();
  options.none_weight = 0.5;
  Recording recording = touches_of_l(4, 810);
  const std::vector<Touch> sound = recording.touches(0, 3);
  recording.T_robot_sensor[3].translation_mm.x = nan;
  const std::vector<Touch> touches = all_touches(recording);
  BoundedPosterior posterior(two_shapes(), options);
  posterior.update(touches[0]);
  const auto before = told_by(posterior, 2);
  expect_refused([&] { posterior.update(touches); }, "T_robot_sensor is not finite");
  EXPECT_EQ(told_by(posterior, 2), before);
  // Broken off at the first call of `progress`, and at the last one.
  int calls = 0;
  BoundedPosterior(two_shapes(), options).update(sound, [&](double done) {
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
  BoundedPosterior other(two_shapes(), options);
  other.update(sound);
  EXPECT_EQ(told_by(posterior, 2), told_by(other, 2)) << "as if nothing had been refused";
}

TEST(BoundedPosterior, HasTheSameBitsOnAnyNumberOfThreads) {
  // More threads than the machine may have cores.
  const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 4);
  const Recording recording = touches_of_l(3, 811);
  std::vector<std::vector<double>> one;
  for (const int threads : {1, 4, 0, 3}) {
    BoundedOptions options = small_options();
    options.none_weight = 0.5;
    options.threads = threads;
    BoundedPosterior posterior(two_shapes(), options);
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
  const Recording recording = touches_of_l(2, 813);
  struct Cancelled {};
  for (const std::optional<double> budget_s : {std::optional<double>(), std::optional(1e3)}) {
    BoundedOptions options = small_options();
    options.budget_s = budget_s;
    BoundedPosterior expected(two_shapes(), options);
    expected.update(recording.touches(0, 2));
    int left = -1;  // cancel points until one throws; never below 0
    int passed = 0;
    options.cancel_point = [&] {
      ++passed;
      if (left >= 0 && left-- == 0) {
        throw Cancelled();
      }
    };
    BoundedPosterior posterior(two_shapes(), options);
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
  const Recording recording = touches_of_l(2, 812);
  BoundedOptions options = small_options();
  options.none_weight = 0.5;
  BoundedPosterior moved(two_shapes(), options);
  moved.estimate();
  moved.move_pivot({-3.0, 4.0});
  options.lattice.pivot_mm = {-3.0, 4.0};
  BoundedPosterior made(two_shapes(), options);
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
  const Recording recording = random_recording(1, 36, 813);
  BoundedPosterior first(two_made_up(), small_options());
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
  const auto refuse = [&](const std::function<void(BoundedOptions&)>& change,
                          const std::string& says) {
    BoundedOptions options = small_options();
    change(options);
    expect_refused([&] { BoundedPosterior(two_made_up(), options); }, says);
  };
  for (const double tolerance : {0.0, -1e-6, 1.0, 2.0, nan, HUGE_VAL}) {
    refuse([&](BoundedOptions& o) { o.tolerance = tolerance; }, "tolerance");
  }
  for (const double number : {0.0, -1.0, nan, HUGE_VAL}) {
    refuse([&](BoundedOptions& o) { o.budget_s = number; }, "budget");
    refuse([&](BoundedOptions& o) { o.evidence_nats = number; }, "evidence_nats");
    refuse([&](BoundedOptions& o) { o.none_weight = number; }, "none_weight");
  }
  for (const double number : {-0.1, nan, HUGE_VAL}) {
    refuse([&](BoundedOptions& o) { o.evidence_growth = number; }, "evidence_growth");
  }
  refuse([&](BoundedOptions& o) { o.threads = -1; }, "threads");
  refuse([&](BoundedOptions& o) { o.lattice.x_mm.count = 0; }, "bins x_mm");
  refuse([&](BoundedOptions& o) { o.contact.gamma = 1.0; }, "gamma");
  expect_refused([&] { BoundedPosterior({}, small_options()); }, "give at least one map");
  std::vector<Hypothesis> objects = two_made_up();
  objects[1].weight = 0.0;
  expect_refused([&] { BoundedPosterior(objects, small_options()); }, "weight");
  objects = two_made_up();
  objects[1].map.prior = 0.4;
  expect_refused([&] { BoundedPosterior(objects, small_options()); }, "prior");
  BoundedPosterior posterior(two_made_up(), small_options());
  expect_refused([&] { posterior.refine({.object = 2}); }, "object 2");
  expect_refused([&] { posterior.refine({.object = 0, .bin = 1'000'000}); }, "bin");
}

}  // namespace palpate::bounded_laws_test
