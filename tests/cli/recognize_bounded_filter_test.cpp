// recognize and live by bounds: --filter bounded, what it finds and what it says of it.

#include <cmath>
#include <sstream>

#include "bounded_filter.hpp"

namespace palpate::recognize_bounded_filter_test {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;
using Arguments = std::vector<std::string>;

/// The laws of what bounds say of a step.
void expect_lawful(const json& step) {
  const json& bounds = step.at("identity_bounds");
  const double dropped = step.at("dropped_mass").get<double>();
  EXPECT_GE(dropped, 0.0);
  EXPECT_LE(dropped, 1.0);
  ASSERT_EQ(bounds.size(), step.at("identity").size());
  double low = 0.0;
  double sum = 0.0;
  double high = 0.0;
  for (const auto& [label, probability] : step.at("identity").items()) {
    const auto p = probability.get<double>();
    ASSERT_EQ(bounds.at(label).size(), 2u);
    EXPECT_GE(bounds[label][0].get<double>(), 0.0);
    EXPECT_LE(bounds[label][0].get<double>(), p) << label;
    EXPECT_GE(bounds[label][1].get<double>(), p) << label;
    EXPECT_LE(bounds[label][1].get<double>(), 1.0);
    low += bounds[label][0].get<double>();
    sum += p;
    high += bounds[label][1].get<double>();
  }
  EXPECT_NEAR(sum, 1.0, 1e-12) << "of a few float64";
  EXPECT_LE(low, 1.0 + 1e-12);
  EXPECT_GE(high, 1.0 - 1e-12);
  EXPECT_GT(step.at("bins_evaluated").get<std::int64_t>(), 0);
  EXPECT_GE(step.at("blocks_bounded").get<std::int64_t>(), 0);
  EXPECT_TRUE(step.at("mode_certain").is_boolean());
}

TEST_F(BoundedFilter, AgreesWithTheHistogram) {
  for (const Arguments& flags :
       {Arguments{"--trace"}, Arguments{"--trace", "--touch-sd-mm=3", "--touch-sd-deg=12"}}) {
    SCOPED_TRACE(flags.size());
    Arguments densely = flags;
    densely.insert(densely.end(), {"--filter", "histogram"});
    const json dense = u(densely);
    Arguments closely = flags;
    closely.insert(closely.end(), {"--evidence-nats", "1e-5"});  // of "(none)", too
    const json r = bounded(closely);
    ASSERT_EQ(r["trace"].size(), dense["trace"].size());
    for (std::size_t i = 0; i < r["trace"].size(); ++i) {
      const json& step = r["trace"][i];
      const json& other = dense["trace"][i];
      EXPECT_EQ(step["best"], other["best"]);
      EXPECT_EQ(step["mode"]["object"], other["mode"]["object"]);
      for (const char* field : {"x_mm", "y_mm", "theta_rad"}) {
        // Both are one bin: the device's angles are in float32.
        EXPECT_NEAR(step["mode"][field].get<double>(), other["mode"][field].get<double>(), 1e-6);
        // Fitted to logs that differ by the histogram's rounding, some 1e-5 nats.
        EXPECT_NEAR(step["refined"][field].get<double>(), other["refined"][field].get<double>(),
                    1e-3);
      }
      for (const char* label : {"A", "I"}) {
        // The tolerance, and the histogram's float32.
        EXPECT_NEAR(step["identity"][label].get<double>(), other["identity"][label].get<double>(),
                    3e-5);
      }
      EXPECT_EQ(step.contains("fit"), other.contains("fit"));
      EXPECT_EQ(step.contains("touch_fit"), other.contains("touch_fit"));
      EXPECT_FALSE(other.contains("dropped_mass")) << "exact";
      EXPECT_FALSE(other.contains("identity_bounds"));
    }
    EXPECT_EQ(r["right"], true);
    EXPECT_EQ(r["device"], "none");
  }
}

TEST_F(BoundedFilter, SaysWhatItProves) {
  const json r = bounded({"--trace"});
  expect_lawful(r);
  EXPECT_LE(r["dropped_mass"].get<double>(), 1e-6) << "the default tolerance";
  for (const json& step : r["trace"]) {
    expect_lawful(step);
    EXPECT_LE(step["dropped_mass"].get<double>(), 1e-4) << "between touches";
  }
  EXPECT_GT(r["trace"][0]["dropped_mass"].get<double>(), 1e-6);
  const json close = bounded({"--trace", "--tolerance", "1e-5"});
  for (const json& step : close["trace"]) {
    EXPECT_LE(step["dropped_mass"].get<double>(), 1e-5);
  }
  EXPECT_LE(bounded({"--tolerance", "1e-3"})["dropped_mass"].get<double>(), 1e-3);
  const json with_evidence = bounded({"--evidence-nats", "0.01"});
  expect_lawful(with_evidence);
  for (const auto& [label, bounds] : with_evidence["identity_bounds"].items()) {
    const auto log_odds = [](double p) { return std::log(p) - std::log1p(-p); };
    if (bounds[0].get<double>() > 0.0 && bounds[1].get<double>() < 1.0) {
      // Both the label's evidence and the others' lie within 0.01 nats.
      EXPECT_LE(log_odds(bounds[1]) - log_odds(bounds[0]), 0.0201) << label;
    }
  }
}

TEST_F(BoundedFilter, IsRightWithinAnyBudget) {
  // However little the budget buys, the answer's bounds hold the histogram's.
  const json dense = u({"--filter", "histogram"});
  const json r = bounded({"--budget-ms", "0.01"});
  expect_lawful(r);
  for (const char* label : {"A", "I"}) {
    const auto p = dense["identity"][label].get<double>();
    // The histogram rounds in float32.
    EXPECT_LE(r["identity_bounds"][label][0].get<double>(), p + 3e-5);
    EXPECT_GE(r["identity_bounds"][label][1].get<double>(), p - 3e-5);
  }
}

TEST_F(BoundedFilter, KnowsNoneOfThese) {
  // Weights below the maps', of the maps, and above; the last by Eq. 7 without a floor.
  for (const Arguments& weight : {Arguments{"--none", "0.01"}, Arguments{"--none"},
                                  Arguments{"--bins=50x50x40", "--none", "100", "--gamma", "0"}}) {
    Arguments flags = weight;
    flags.insert(flags.begin(), "--trace");
    if (weight.size() < 3) {
      flags.insert(flags.begin(), "--bins=12x12x16");
    }
    flags.insert(flags.begin(), {"u.h5", "--maps", "maps"});
    Arguments by_bounds = flags;
    by_bounds.insert(by_bounds.begin(), {"--filter", "bounded"});
    flags.insert(flags.begin(), {"--filter", "histogram"});
    const json dense = record(flags);
    const json r = record(by_bounds);
    ASSERT_EQ(r["trace"].size(), dense["trace"].size());
    for (std::size_t i = 0; i < r["trace"].size(); ++i) {
      const json& step = r["trace"][i];
      expect_lawful(step);
      EXPECT_EQ(step["identity"].at("(none)"), step["none"]);
      const json& bounds = step["identity_bounds"].at("(none)");
      // Its log odds are known within 0.3 nats, which move a probability by a quarter of it at
      // most.
      EXPECT_LE(bounds[1].get<double>() - bounds[0].get<double>(), 0.075 + 4e-6);
      const double exact = dense["trace"][i]["none"].get<double>();
      EXPECT_LE(bounds[0].get<double>(), exact + 1e-5) << "and the histogram's float32";
      EXPECT_GE(bounds[1].get<double>(), exact - 1e-5);
    }
    const json& bounds = r["identity_bounds"];
    const json& best = bounds[r["best"].get<std::string>()];
    const json& exact_best = bounds[dense["best"].get<std::string>()];
    EXPECT_GE(exact_best[1].get<double>(), best[0].get<double>()) << "one of the most probable";
  }
  refused({"--filter", "bounded", "--none=-1"}, {"--none -1", "from 0"});
}

TEST_F(BoundedFilter, AWeightOfNoneOf0LeavesItOut) {
  for (const char* filter : {"bounded", "histogram"}) {
    EXPECT_TRUE(u({"--filter", filter}).contains("none"));
    const json without = u({"--filter", filter, "--none", "0"});
    EXPECT_FALSE(without.contains("none"));
    EXPECT_FALSE(without["identity"].contains("(none)"));
  }
}

TEST_F(BoundedFilter, AutoKeepsNoneOfThese) {
  const json r = record({"u.h5", "--maps", "maps", "--bins=120x120x16", "--none"});
  EXPECT_TRUE(r.contains("dropped_mass")) << "by bounds";
  expect_lawful(r);
  EXPECT_EQ(r["identity"].at("(none)"), r["none"]);
  EXPECT_TRUE(r["identity_bounds"].contains("(none)"));
  const Outcome table = palpate({"recognize", "u.h5", "--maps", "maps", "--bins=12x12x16",
                                 "--filter", "bounded", "--none", "1e300"});
  EXPECT_EQ(table.status, 0) << table.err;
  EXPECT_THAT(table.out, HasSubstr("\n  pose "));
  EXPECT_THAT(table.out, HasSubstr("dropped"));
}

TEST_F(BoundedFilter, TakesEachFrameByItself) {
  const json frames = records(with({"--filter", "bounded", "--each-frame", "--frames=0:2"}));
  ASSERT_EQ(frames.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    expect_lawful(frames[i]);
    const json alone = bounded({"--frames", std::to_string(i) + ":" + std::to_string(i + 1)});
    EXPECT_EQ(frames[i]["identity"], alone["identity"]);
    EXPECT_EQ(frames[i]["mode"], alone["mode"]);
  }
}

TEST_F(BoundedFilter, WritesThePosteriorOfTheBinsThatItEvaluated) {
  u({"--posterior", "all.h5"});
  const Posterior all = read_posterior(folder_ / "all.h5");
  EXPECT_FALSE(all.rest_mass_bound) << "auto writes every bin";
  for (const Arguments& asks :
       {Arguments{"--filter", "bounded"}, Arguments{"--tolerance", "1e-3"}}) {
    Arguments flags = asks;
    flags.insert(flags.end(), {"--posterior", "some.h5"});
    const json record = u(flags);
    const Posterior some = read_posterior(folder_ / "some.h5");
    EXPECT_EQ(some.objects, all.objects);
    EXPECT_EQ(some.lattice.bins(), all.lattice.bins());
    EXPECT_EQ(some.index.size(), record["bins_evaluated"]);
    ASSERT_TRUE(some.rest_mass_bound);
    EXPECT_GE(*some.rest_mass_bound, record["dropped_mass"].get<double>());
    EXPECT_LT(*some.rest_mass_bound, 1e-3);
    for (std::size_t i = 0; i < some.index.size(); ++i) {
      EXPECT_NEAR(some.log_likelihood[i],
                  all.log_likelihood[static_cast<std::size_t>(some.index[i])], 1e-3);
    }
  }
}

TEST_F(BoundedFilter, PeopleReadTheCertificate) {
  const Outcome outcome = palpate(
      {"recognize", "u.h5", "--maps", "maps", "--bins=12x12x16", "--filter", "bounded", "--trace"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  const std::size_t first = outcome.out.find("dropped");
  ASSERT_NE(first, std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("dropped", first + 1), std::string::npos)
      << "in the trace and in the table";
  EXPECT_THAT(outcome.out, HasSubstr("12 x 12 x 16 bins each by bounds\n"));
  EXPECT_THAT(outcome.out, Not(HasSubstr("unproven")));
  const Outcome dense =
      palpate({"recognize", "u.h5", "--maps", "maps", "--bins=12x12x16", "--trace"});
  EXPECT_THAT(dense.out, Not(HasSubstr("dropped")));
  EXPECT_THAT(dense.out, Not(HasSubstr("by bounds")));
}

TEST_F(BoundedFilter, RecognisesLive) {
  done({"record", "--sensor", "simulate:A,rate=100,seed=3,object=random,touches=4,speed=max", "-o",
        "frames.h5"});
  const Arguments shared{"--maps", "maps", "--bins=12x12x16", "--filter", "bounded"};
  Arguments live{"live", "--sensor", "replay:frames.h5,speed=max", "--json", "live.jsonl"};
  live.insert(live.end(), shared.begin(), shared.end());
  const Outcome outcome = palpate(live);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("prob.  dropped"));
  done({"touches", "frames.h5", "-o", "touches.h5"});
  Arguments recognize{"touches.h5", "--trace", "--tolerance", "1e-6"};
  recognize.insert(recognize.end(), shared.begin(), shared.end());
  const json trace = record(recognize)["trace"];
  std::istringstream lines(bytes_of(folder_ / "live.jsonl"));
  for (const json& step : trace) {
    std::string line;
    ASSERT_TRUE(std::getline(lines, line));
    const json touch = json::parse(line);
    expect_lawful(touch);
    // Nothing is evaluated ahead: the same numbers.
    for (const char* field : {"identity", "mode", "refined", "dropped_mass", "identity_bounds",
                              "bins_evaluated", "blocks_bounded"}) {
      EXPECT_EQ(touch.at(field), step.at(field)) << field;
    }
  }
  EXPECT_EQ(trace.size(), 4u);
}

}  // namespace palpate::recognize_bounded_filter_test
