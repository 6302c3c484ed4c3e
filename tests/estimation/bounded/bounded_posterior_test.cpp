// What a bounded posterior tells, takes in and refuses.

#include "palpate/bounded_posterior.hpp"

#include <functional>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "bound_cases.hpp"
#include "support/certified.hpp"

namespace palpate::bounded_posterior_test {

TEST(BoundedPosterior, SaysHowItSearches) {
  const BoundedPosterior posterior(two_made_up(), small_options());
  EXPECT_FALSE(posterior.path().empty());
  EXPECT_EQ(posterior.path().find('\n'), std::string::npos);
}

/// Elements in contact where all cells of a map have the same log odds.
struct Contradiction {
  int side = 0;           ///< of the square of elements
  float heavy = 0.0F;     ///< log odds that contradict the touch by more than 700 nats
  float light = 0.0F;     ///< log odds that contradict it by less
  float as_heavy = 0.0F;  ///< log odds that contradict it by more than 700 nats, too
};

TEST(BoundedPosterior, IsContradictedWhereTheDenseOneIs) {
  BoundedOptions options = small_options();
  options.contact.gamma = 0.0;
  // By few elements beyond what a tile's penalties hold, and by many within it.
  for (const Contradiction& by :
       {Contradiction{2, -500.0F, -150.0F, -400.0F}, Contradiction{9, -12.0F, -8.0F, -11.0F}}) {
    Recording recording;
    recording.T_robot_sensor = {{}};
    for (int i = 0; i < by.side * by.side; ++i) {
      recording.elements_mm.emplace_back(0.2 * (i % by.side), 0.2 * (i / by.side));
      recording.pressure.push_back(9.0);
    }
    for (const double weight : {1.0, 1e-300}) {
      for (const bool contradicted : {false, true}) {
        SCOPED_TRACE(::testing::Message() << by.side << " elements a side, weight " << weight);
        std::vector<Hypothesis> objects{{random_map(61, 61, 0.5, 1.0, 814), 1.0},
                                        {random_map(61, 61, 0.5, 1.0, 815), weight}};
        objects[0].map.log_odds.assign(61 * 61, by.heavy);
        objects[1].map.log_odds.assign(61 * 61, contradicted ? by.as_heavy : by.light);
        BothFilters both(objects, options);
        both.update(recording.touch(0));
        EXPECT_EQ(both.dense.estimate().contradicted, contradicted);
        EXPECT_EQ(both.bounded.estimate().contradicted, contradicted);
        EXPECT_EQ(both.bounded.estimate().mode.object, both.dense.estimate().mode.object);
      }
    }
  }
}

TEST(BoundedPosterior, TakesInAllTouchesOrNone) {
  BoundedOptions options = small_options();
  options.none_weight = 0.5;
  Recording recording = touches_of_l(4, 810);
  const std::vector<Touch> sound = recording.touches(0, 3);
  recording.T_robot_sensor[3].translation_mm.x = nan;
  BoundedPosterior posterior(two_shapes(), options);
  posterior.update(sound[0]);
  const auto before = all_answers(posterior, 2);
  expect_named(input_error([&] { posterior.update(all_touches(recording)); }),
               {"T_robot_sensor is not finite"});
  EXPECT_EQ(all_answers(posterior, 2), before);
  int calls = 0;
  const auto break_off = [&](double done) {
    EXPECT_EQ(done, 1.0);
    ++calls;
    throw std::runtime_error("broken off");
  };
  EXPECT_THROW(posterior.update(std::span(sound).subspan(1), break_off), std::runtime_error);
  EXPECT_EQ(calls, 1);
  EXPECT_EQ(all_answers(posterior, 2), before);
  posterior.update(std::span(sound).subspan(1));
  BoundedPosterior other(two_shapes(), options);
  other.update(sound);
  EXPECT_EQ(all_answers(posterior, 2), all_answers(other, 2)) << "as if nothing had been refused";
}

TEST(BoundedPosterior, CanBeCancelledInEveryCallThatSearches) {
  struct Cancelled {};
  for (const std::optional<double> budget_s : {std::optional<double>(), std::optional(1e3)}) {
    BoundedOptions options = small_options();
    options.budget_s = budget_s;
    options.cancel_point = [] { throw Cancelled(); };
    BoundedPosterior posterior(two_shapes(), options);
    posterior.update(all_touches(touches_of_l(2, 813)));
    EXPECT_THROW(posterior.estimate(), Cancelled);
    EXPECT_THROW(posterior.marginals(0), Cancelled);
    EXPECT_THROW(posterior.entropy(), Cancelled);
    EXPECT_THROW(posterior.sample(3, 1), Cancelled);
    EXPECT_THROW(posterior.refined_blocks(), Cancelled);
  }
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
    expect_named(input_error(call), {"bounded posterior: was moved from"});
  }
  first = std::move(second);
  EXPECT_NE(first.estimate().mode.log_likelihood, 0.0);
}
// NOLINTEND(bugprone-use-after-move)

TEST(BoundedPosterior, RefusesOptionsOutOfRange) {
  std::vector<Hypothesis> objects = two_made_up();
  BoundedOptions options = small_options();
  const auto refuse = [&](auto& field, auto value, const char* named) {
    SCOPED_TRACE(testing::Message() << named << " = " << value);
    const auto before = std::exchange(field, value);
    expect_named(input_error([&] { BoundedPosterior(objects, options); }), {named});
    field = before;
  };
  for (const double number : {0.0, -1.0, nan, infinity}) {
    refuse(options.tolerance, number, "tolerance");
    refuse(options.budget_s, number, "budget");
    refuse(options.evidence_nats, number, "evidence_nats");
    refuse(options.none_weight, number, "none_weight");
  }
  refuse(options.tolerance, 1.0, "tolerance");
  for (const double number : {-0.1, nan, infinity}) {
    refuse(options.evidence_growth, number, "evidence_growth");
  }
  refuse(options.threads, -1, "threads");
  refuse(options.lattice.x_mm.count, 0, "bins x_mm");
  refuse(options.contact.gamma, 1.0, "gamma");
  refuse(objects[1].weight, 0.0, "weight");
  refuse(objects[1].map.prior, 0.4, "prior");
  objects.clear();
  expect_named(input_error([&] { BoundedPosterior(objects, options); }), {"at least one map"});
}

TEST(BoundedPosterior, RefusesQuestionsOutOfRange) {
  const BoundedPosterior posterior(two_made_up(), small_options());
  PoseLattice reversed = small_options().lattice;
  reversed.x_mm = {1.0, -1.0, 3};
  const auto refused = [](const std::function<void()>& question, const char* named) {
    expect_named(input_error(question), {named});
  };
  refused([&] { posterior.refine({.object = 2}); }, "object 2");
  refused([&] { posterior.refine({.object = 0, .bin = 1'000'000}); }, "bin");
  refused([&] { posterior.marginals(2); }, "object 2");
  refused([&] { posterior.marginals(0, reversed); }, "reversed");
  refused([&] { posterior.log_likelihood(2, {}); }, "object 2");
  refused([&] { posterior.log_likelihood(-1, {}); }, "object -1");
  refused([&] { posterior.log_likelihood(0, {{nan, 0.0}, 0.0}); }, "finite");
  for (const double tolerance : {0.0, 1.0, nan}) {
    refused([&] { posterior.estimate(tolerance); }, "tolerance");
  }
  refused([&] { posterior.expected_gain({}, digitacts_array()); }, "no candidate");
}

}  // namespace palpate::bounded_posterior_test
