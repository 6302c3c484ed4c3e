// The laws of the bounded posterior in every regime: by Eq. 7 and by a table, at rest and
// displaced; and its certificate against the posterior over all bins in float64, over many
// unknowns.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "../made_up_sensors.hpp"
#include "bound_cases.hpp"
#include "palpate/bounded_posterior.hpp"
#include "support/certified.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"
#include "support/touched_shape.hpp"
#include "support/trials.hpp"

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
  for (const double cell_mm : {0.5, 1.0, 0.1}) {  // 0.1 mm is no binary fraction
    all.push_back({fmt::format("OnNodes{}UmApart", std::lround(1000.0 * cell_mm)),
                   {{random_map(41, 41, cell_mm, 12.0, 860), 1.0},
                    {random_map(41, 41, cell_mm, 12.0, 861), 1.0}},
                   {.lattice = cell_by_cell(cell_mm)},
                   touches_on_nodes(cell_mm)});
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
  BothFilters both(objects, options);
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
    for (const double budget_s : {1e-9, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e30}) {
      SCOPED_TRACE(testing::Message() << count << " touches, " << budget_s << " s");
      options.budget_s = budget_s;
      BoundedPosterior posterior(objects, options);
      for (const Touch& touch : touches) {
        posterior.update(touch);
        posterior.estimate();
      }
      expect_certified(posterior, objects, options, truth);
      EXPECT_LT(posterior.estimate().certificate->dropped_mass, budget_s < 1.0 ? 1.1 : 0.01);
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

/// An unknown, its objects and its touches.
struct Trial {
  std::vector<Hypothesis> objects;
  BoundedOptions options;
  Recording recording;
};

/// A trial over a lattice of so many bins in x, y and theta: two to four objects, letters and
/// made-up maps in turn, of unequal weights and cells, under 1 to 9 touches.
Trial make_trial(const std::array<int, 3>& bins, std::uint64_t seed) {
  Uniform random(seed);
  Trial trial;
  PoseLattice& lattice = trial.options.lattice;
  const double half_mm = one_of(random, std::array{5.0, 10.0, 25.0});
  lattice.x_mm = {-half_mm + random(-1.0, 1.0), half_mm, bins[0]};
  lattice.y_mm = {-half_mm, half_mm + random(-1.0, 1.0), bins[1]};
  lattice.theta_rad = {0.0, one_of(random, std::array{two_pi, two_pi, 2.0}), bins[2]};
  lattice.pivot_mm = {random(-5.0, 5.0), random(-5.0, 5.0)};
  trial.options.contact.gamma = one_of(random, std::array{0.1, 0.1, 0.02, 0.0});
  trial.options.tolerance = one_of(random, std::array{1e-6, 1e-6, 1e-9, 1e-3});
  const auto touches = static_cast<std::size_t>(random(1.0, 10.0));
  const auto object_seed = static_cast<std::uint64_t>(random(1.0, 1e9));
  if (random(0.0, 2.0) < 1.0) {
    trial.objects = {{map_of(on_letter_l, "L"), 1.0}, {map_of(on_disc, "disc"), 1.0}};
    const Pose T_object_robot{{random(-4.0, 4.0), random(-4.0, 4.0)}, random(0.0, 2.0)};
    trial.recording = touches_of(on_letter_l, T_object_robot, touches, object_seed);
  } else {
    const double steepness = one_of(random, std::array{1.0, 4.0, 12.0});
    trial.objects = {{random_map(31, 27, 0.5, steepness, object_seed), 1.0},
                     {random_map(17, 23, 0.8, steepness, object_seed + 1), 1.0}};
    trial.recording =
        random_recording(touches, static_cast<std::size_t>(random(1.0, 40.0)), object_seed + 2);
  }
  if (random(0.0, 2.0) < 1.0) {
    trial.objects.push_back({random_map(40, 9, 0.37, 6.0, object_seed + 3), 1.0});
    trial.objects.push_back({random_map(1, 1, 4.0, 6.0, object_seed + 4), 1.0});
  }
  for (Hypothesis& object : trial.objects) {
    object.weight = one_of(random, std::array{1.0, 1.0, 0.2, 1e-6});
  }
  return trial;
}

/// A trial as make_trial() has it where touches are displaced: by standard deviations from 0 to
/// beyond half the region, about pivots near and far, on lattices some of which have an axis of one
/// bin.
Trial make_displaced_trial(const std::array<int, 3>& bins, std::uint64_t seed) {
  Trial trial = make_trial(bins, seed);
  Uniform random(seed + 1);
  PoseLattice& lattice = trial.options.lattice;
  lattice.pivot_mm *= one_of(random, std::array{1.0, 1.0, 10.0});
  Axis* const fixed =
      one_of(random, std::array<Axis*, 8>{&lattice.x_mm, &lattice.y_mm, &lattice.theta_rad});
  if (fixed != nullptr) {
    fixed->count = 1;
  }
  if (random(0.0, 4.0) < 1.0) {
    lattice.collapse_fixed();
  }
  trial.options.touch_sd = {.mm = one_of(random, std::array{0.0, 0.3, 1.0, 1.0, 2.5, 6.0}),
                            .rad = one_of(random, std::array{0.0, 0.05, 0.05, 0.3, 1.5})};
  if (trial.options.touch_sd.none()) {
    trial.options.touch_sd.mm = 1.0;
  }
  // Where a far pivot turns a bin to is known to 1e-14 of a step, which may count for as much.
  trial.options.tolerance = std::max(trial.options.tolerance, 1e-7);
  return trial;
}

/// Unknowns over a lattice of so many bins in x, y and theta.
struct Unknowns {
  const char* name;
  std::array<int, 3> bins;
  int count;
  std::uint64_t seed;
  Trial (*make)(const std::array<int, 3>& bins, std::uint64_t seed) = make_trial;
};

class CertificateLaw : public testing::TestWithParam<Unknowns> {};

// The float64 posterior of all bins is what takes long: smaller lattices try many more unknowns.
INSTANTIATE_TEST_SUITE_P(
    Unknowns, CertificateLaw,
    testing::Values(
        Unknowns{"OfAHundredBins", {7, 5, 3}, 30, 901},
        // Steps of 1 to 7 mm, over cells of 0.37 to 4 mm: tiles of single bins.
        Unknowns{"OfBinsCellsApart", {7, 8, 6}, 20, 905},
        Unknowns{"OfTwoThousandBins", {12, 12, 16}, 8, 902},
        Unknowns{"OfThirtyThousandBins", {30, 31, 32}, 1, 921},
        Unknowns{"DisplacedOfAHundredBins", {7, 5, 3}, 25, 931, make_displaced_trial},
        Unknowns{"DisplacedOfTwoThousandBins", {12, 12, 16}, 3, 932, make_displaced_trial},
        Unknowns{"DisplacedOfTenThousandBins", {25, 25, 16}, 1, 933, make_displaced_trial}),
    [](const auto& info) { return info.param.name; });

TEST_P(CertificateLaw, Holds) {
  const Unknowns& unknowns = GetParam();
  for (int i = 0; i < trials(unknowns.count); ++i) {
    SCOPED_TRACE(::testing::Message() << "trial " << i);
    const Trial trial =
        unknowns.make(unknowns.bins, 1000 * unknowns.seed + static_cast<std::uint64_t>(i));
    // Log odds of 12 at gamma = 0 sum to some thousand nats, and float64 keeps 16 digits of them.
    expect_certified(trial.objects, trial.options, all_touches(trial.recording), 1e-9);
  }
}

TEST(CertificateLaw, KeepsEveryTolerance) {
  // No sum of float64 is certain to 1e-15: such a tolerance is met as far as rounding lets it.
  for (const double tolerance : {1e-15, 1e-12, 1e-9, 1e-3, 0.1, 0.9}) {
    SCOPED_TRACE(::testing::Message() << tolerance);
    Trial trial = make_trial({15, 14, 12}, 912);
    trial.options.tolerance = tolerance;
    expect_certified(trial.objects, trial.options, all_touches(trial.recording));
  }
}

/// An unknown whose objects bear labels, the first character the first object's.
Trial labelled_trial(const std::string& labels) {
  Trial trial = make_trial({15, 14, 12}, 911);
  for (std::size_t i = 0; i < trial.objects.size(); ++i) {
    trial.objects[i].map.label = labels[i];
  }
  return trial;
}

TEST(CertificateLaw, BoundsEveryLogEvidenceWithinTheNatsAskedFor) {
  // The last two share a label, whose evidence counts together.
  Trial trial = labelled_trial("ABCC");
  // Tens of nats below, so that the tolerance would drop it.
  trial.objects[1].weight = 1e-30;
  for (const double nats : {3.0, 0.3, 0.01}) {
    for (const double tolerance : {1e-6, 0.3}) {
      trial.options.tolerance = tolerance;
      trial.options.evidence_nats = nats;
      const Certified seen =
          expect_certified(trial.objects, trial.options, all_touches(trial.recording));
      EXPECT_LE(seen.widest_nats, nats);
    }
  }
}

TEST(CertificateLaw, BoundsLabelsBelowTheRangeNoCloserThanThat) {
  Trial trial = labelled_trial("ABAA");
  trial.objects[1].weight = 1e-30;
  trial.options.evidence_nats = 0.01;
  const auto bins_evaluated = [&](double range_nats) {
    trial.options.evidence_range_nats = range_nats;
    const Certified seen =
        expect_certified(trial.objects, trial.options, all_touches(trial.recording));
    const Certificate& certificate = *seen.estimate.certificate;
    const double largest =
        std::max(certificate.log_evidence[0].low, certificate.log_evidence[2].low);
    EXPECT_LE(certificate.log_evidence[1].high, std::max(largest - range_nats, largest - 60.0));
    return certificate.bins_evaluated;
  };
  EXPECT_LT(bins_evaluated(20.0), bins_evaluated(200.0));
}

TEST(CertificateLaw, BoundsEvidenceLessCloselyWithEveryTouchWhereAskedTo) {
  Trial trial = labelled_trial("ABAA");
  trial.options.tolerance = 0.3;
  trial.options.evidence_nats = 0.001;
  const std::vector<Touch> touches = all_touches(trial.recording);
  ASSERT_GT(touches.size(), 1U);
  const auto seen_with = [&](double growth) {
    trial.options.evidence_growth = growth;
    return expect_certified(trial.objects, trial.options, touches);
  };
  const Certified same = seen_with(0.0);
  const Certified grown = seen_with(500.0);
  EXPECT_LE(same.widest_nats, 0.001);
  EXPECT_LE(grown.widest_nats, 0.001 * (1.0 + 500.0 * static_cast<double>(touches.size() - 1)));
  EXPECT_LT(grown.estimate.certificate->bins_evaluated, same.estimate.certificate->bins_evaluated);

  // Touches count one by one, and no more after a reset.
  BoundedPosterior posterior(trial.objects, trial.options);
  const auto bins_evaluated = [&] { return posterior.estimate().certificate->bins_evaluated; };
  for (const Touch& touch : touches) {
    posterior.update(touch);
  }
  EXPECT_EQ(bins_evaluated(), grown.estimate.certificate->bins_evaluated);
  posterior.reset();
  posterior.update(touches.front());
  const reference::Posterior truth =
      reference_posterior(trial.objects, trial.options, std::span(touches).first(1));
  EXPECT_LE(expect_certified(posterior, trial.objects, trial.options, truth).widest_nats, 0.001);
  // A touch that tells nothing does not count.
  const std::int64_t bins = bins_evaluated();
  const std::vector<double> nothing(touches.front().pressure.size(), nan);
  Touch silent = touches.front();
  silent.pressure = nothing;
  posterior.update(silent);
  EXPECT_EQ(bins_evaluated(), bins);
}

}  // namespace palpate::bounded_laws_test
