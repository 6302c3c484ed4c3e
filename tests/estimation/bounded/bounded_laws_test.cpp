// The laws of the bounded posterior in every regime: by Eq. 7 and by a table, at rest and
// displaced.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "../made_up_sensors.hpp"
#include "bound_cases.hpp"
#include "bounded_set_up.hpp"
#include "support/certified.hpp"
#include "support/touched_shape.hpp"

namespace palpate::bounded_laws_test {

/// Objects and touches under one model.
struct Regime {
  std::string name;
  std::vector<Hypothesis> objects;
  BoundedOptions options;
  Recording recording;
};

std::vector<Regime> regimes() {
  std::vector<Regime> all;
  for (const bool displaced : {false, true}) {
    const BoundedOptions options = displaced ? uncertain_options() : small_options();
    const std::string name = displaced ? "Displaced" : "AtRest";
    all.push_back({name + "ByEquation7", two_shapes(), options, touches_of_l(5, 951)});

    Regime& without_gamma = all.emplace_back(all.back());
    without_gamma.name = name + "WithoutGamma";
    without_gamma.options.contact.gamma = 0.0;

    all.push_back({name + "ByATable", two_made_up(), options, random_recording(4, 20, 953)});
    all.back().options.contact.table = crooked_table();
    for (double& nats : all.back().options.contact.table->log_likelihood) {
      // Between likelihoods that lie thousands of nats apart, a turned bin's place is not certain.
      nats = std::clamp(nats, -9.0, 0.0);
    }

    for (const MapLayer layer : {MapLayer::log_odds, MapLayer::mean_level}) {
      const LearnedScene scene = learned_scene(layer, 321);
      all.push_back({fmt::format("{}ByLayer{}", name, static_cast<int>(layer)), scene.objects,
                     options, random_recording(3, 20, 955)});
      all.back().options.contact = scene.contact;
    }

    // All elements are unknown, in contact, unknown and not in contact.
    Recording alike = random_recording(4, 12, 868);
    for (std::size_t i = 0; i < alike.pressure.size(); ++i) {
      alike.valid.push_back(i / 12 % 2 == 0 ? 0 : 1);
      alike.pressure[i] = i / 12 == 1 ? 10.0 : 0.0;
    }
    all.push_back({name + "ByTouchesOfOneReading", two_made_up(), options, alike});

    all.push_back({name + "WithNoneOfThese", two_shapes(), options, touches_of_l(4, 952)});
    all.back().options.none_weight = 2.0;
    all.back().options.evidence_nats = 1e-4;  // of "none of these", too

    all.push_back({name + "WithEvidence", two_made_up(), options, random_recording(3, 36, 954)});
    all.back().objects[0].weight = 1e-9;
    all.back().options.evidence_nats = 0.01;
  }
  return all;
}

class BoundedLaws : public testing::TestWithParam<Regime> {};

INSTANTIATE_TEST_SUITE_P(Regimes, BoundedLaws, testing::ValuesIn(regimes()),
                         [](const auto& info) { return info.param.name; });

TEST_P(BoundedLaws, HoldInFloat64AndToTheBit) {
  expect_laws(GetParam().objects, GetParam().options, GetParam().recording);
}

/// Expects bounds to agree with the histogram about "none of these" after so many touches, of each
/// of which the method allows a float32 mean 1e-3 nats, and its bounds to hold its log evidence and
/// its odds against the first object.
void expect_none_as_dense(const Estimate& ours, const Estimate& theirs, std::size_t touches) {
  const double nats = 1e-3 * static_cast<double>(touches) + 1e-9;
  const LogInterval none = ours.certificate->none_log_evidence.value();
  const double share = *theirs.none_log_evidence - theirs.log_evidence[0];
  EXPECT_LE(none.low - ours.log_evidence[0], share + nats);
  EXPECT_GE(none.high - ours.log_evidence[0], share - nats);
  EXPECT_LE(none.low, *ours.none_log_evidence);
  EXPECT_GE(none.high, *ours.none_log_evidence);
  const auto [least, most] = ours.certificate->log_evidence[0];
  const double against = ours.log_evidence[0] - *ours.none_log_evidence;
  EXPECT_NEAR(std::log(ours.identity[0] / ours.none), against, 1e-9);
  EXPECT_GE(against, least - none.high - 1e-12);
  EXPECT_LE(against, most - none.low + 1e-12);
}

void expect_same_pose(const RefinedPose& ours, const RefinedPose& theirs) {
  // Logs that are 1e-4 nats off per touch move a mean within 2.5 mm by at most some 1e-3 mm.
  const auto& [our_mm, our_rad] = ours.T_object_robot;
  const auto& [their_mm, their_rad] = theirs.T_object_robot;
  EXPECT_NEAR(our_mm.x, their_mm.x, 1e-3);
  EXPECT_NEAR(our_mm.y, their_mm.y, 1e-3);
  EXPECT_NEAR(our_rad, their_rad, 1e-3);
  const auto& covariance = theirs.covariance;
  for (std::size_t k = 0; k < 9; ++k) {
    EXPECT_NEAR(ours.covariance[k], covariance[k],
                1e-9 + 1e-3 * std::max(covariance[4 * (k / 3)], covariance[4 * (k % 3)]));
  }
}

TEST_P(BoundedLaws, TellWhatFloat64LeavesOutAsTheHistogramDoes) {
  const auto& [name, objects, options, recording] = GetParam();
  Device device = Device::open();
  BothFilters both(device, objects, options);
  for (std::size_t n = 0; n <= recording.size(); ++n) {
    SCOPED_TRACE(testing::Message() << n << " touches");
    if (n > 0) {
      both.update(recording.touch(n - 1));
    }
    const Estimate ours = both.bounded.estimate();
    const Estimate theirs = both.dense.estimate();
    EXPECT_EQ(ours.contradicted, theirs.contradicted);
    expect_same_pose(both.bounded.refine(theirs.mode), both.dense.refine(theirs.mode));
    if (n == recording.size()) {  // fewer leave ties
      EXPECT_EQ(ours.mode.object, theirs.mode.object);
      EXPECT_EQ(ours.mode.bin, theirs.mode.bin);
      EXPECT_EQ(ours.mode.T_object_robot.theta_rad, theirs.mode.T_object_robot.theta_rad);
    }
    if (options.none_weight) {
      expect_none_as_dense(ours, theirs, n);
      EXPECT_LT(largest_difference(ours.identity, theirs.identity), 1e-4);
      EXPECT_NEAR(sum(ours.identity) + ours.none, 1.0, 1e-12);
      EXPECT_NEAR(both.bounded.entropy(), both.dense.entropy(), 1e-3 + 1e-4);
    }
  }
}

TEST_P(BoundedLaws, AreCertifiedWithinAnyBudget) {
  const auto& [name, objects, given, recording] = GetParam();
  if (given.none_weight) {
    return;  // which float64 here leaves out
  }
  BoundedOptions options = given;
  // After one touch nearly every bin matters, and the budget leaves most of them out.
  for (const std::size_t count : {std::size_t{1}, recording.size()}) {
    const std::vector<Touch> touches = recording.touches(0, count);
    const reference::Posterior truth = reference_posterior(objects, options, touches);
    for (const double budget_s : {1e-9, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 10.0}) {
      SCOPED_TRACE(testing::Message() << count << " touches, " << budget_s << " s");
      options.budget_s = budget_s;
      BoundedPosterior posterior(objects, options);
      for (const Touch& touch : touches) {
        posterior.update(touch);
        posterior.estimate();
      }
      expect_certified(posterior, objects, options, truth);
    }
  }
}

TEST(BoundedPosterior, AnswersVeryManyTouchesByFewBins) {
  BoundedOptions options = small_options();
  // The mode's log-likelihood falls with each touch, and the bounds of large tiles lie above it by
  // ever more nats. Each of ten touches comes ten times.
  const Recording recording = touches_of_l(10, 811);
  reference::Posterior truth = reference_posterior(two_shapes(), options, all_touches(recording));
  for (std::vector<double>& logs : truth.log_likelihood) {
    std::ranges::transform(logs, logs.begin(), [](double nats) { return 10.0 * nats; });
  }
  for (const bool evidence : {false, true}) {
    SCOPED_TRACE(evidence);
    if (evidence) {
      options.evidence_nats = 0.05;
      options.evidence_range_nats = 100.0;
    }
    BoundedPosterior posterior(two_shapes(), options);
    for (int time = 0; time < 10; ++time) {
      posterior.update(all_touches(recording));
    }
    const Certified seen = expect_certified(posterior, two_shapes(), options, truth, 1e-8);
    EXPECT_LT(seen.estimate.certificate->bins_evaluated, options.lattice.bins() / 10);
  }
}

}  // namespace palpate::bounded_laws_test
