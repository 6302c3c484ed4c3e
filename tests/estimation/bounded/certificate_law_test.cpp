// The certificate against the posterior over all bins in float64, over many unknowns.

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "certificate_trials.hpp"
#include "support/certified.hpp"
#include "support/limits.hpp"
#include "support/trials.hpp"

namespace palpate::certificate_law_test {

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

TEST(CertificateLaw, HoldsWithinAnyBudgetAfterOneTouch) {
  // Nearly every bin matters: the budget leaves most of them out.
  for (const double budget_s : {1e-9, 1e-5, 1e-4, 1e-3}) {
    for (std::uint64_t seed = 905; seed < 908; ++seed) {
      SCOPED_TRACE(::testing::Message() << budget_s << " s, seed " << seed);
      Trial trial = make_trial({15, 14, 12}, seed);
      trial.options.budget_s = budget_s;
      expect_certified(trial.objects, trial.options, trial.recording.touches(0, 1));
    }
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

}  // namespace palpate::certificate_law_test
