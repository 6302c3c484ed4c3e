// The certificate against the posterior over all bins in float64, over many unknowns.

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "bounded/certificate_trials.hpp"
#include "support/sanitized.hpp"

namespace palpate::certificate_law_test {

TEST(CertificateLaw, HoldsOverFiftyUnknownsOfAHundredBins) { expect_trials({7, 5, 3}, 50, 901); }
TEST(CertificateLaw, HoldsOverFiftyUnknownsOfBinsCellsApart) {
  // Steps of 1 to 7 mm, over cells of 0.37 to 4 mm: tiles of single bins.
  expect_trials({7, 8, 6}, 50, 905);
}
TEST(CertificateLaw, HoldsOverUnknownsOfTwoThousandBins) {
  expect_trials({12, 12, 16}, sanitized ? 8 : 16, 902);
}
TEST(CertificateLaw, HoldsWithinAnyBudget) {
  expect_certified_within(make_trial({15, 14, 12}, 904),
                          {1e-9, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 10.0});
}

TEST(CertificateLaw, HoldsWithinAnyBudgetAfterOneTouch) {
  // Nearly every bin matters: the budget leaves most of them out.
  for (const double budget_s : {1e-9, 1e-5, 1e-4, 1e-3}) {
    for (std::uint64_t seed = 905; seed < 910; ++seed) {
      SCOPED_TRACE(::testing::Message() << budget_s << " s, seed " << seed);
      Trial trial = make_trial({15, 14, 12}, seed);
      trial.recording = first_touches(trial.recording, 1);
      trial.options.budget_s = budget_s;
      expect_certified(trial.objects, trial.options, all_touches(trial.recording));
    }
  }
}

TEST(CertificateLaw, BoundsEveryLogEvidenceWithinTheNatsAskedFor) {
  for (const double nats : {3.0, 0.3, 0.01}) {
    for (const double tolerance : {1e-6, 0.3}) {
      Trial trial = make_trial({15, 14, 12}, 911);
      // The last two share a label, whose evidence counts together.
      for (std::size_t i = 0; i < trial.objects.size(); ++i) {
        trial.objects[i].map.label = i == 0 ? "A" : i == 1 ? "B" : "C";
      }
      // Tens of nats below, so that the tolerance would drop it.
      trial.objects[1].weight = 1e-30;
      trial.options.tolerance = tolerance;
      trial.options.evidence_nats = nats;
      const Certified seen =
          expect_certified(trial.objects, trial.options, all_touches(trial.recording));
      EXPECT_LE(seen.widest_nats, nats);
    }
  }
}

TEST(CertificateLaw, BoundsLabelsBelowTheRangeNoCloserThanThat) {
  Trial trial = make_trial({15, 14, 12}, 911);
  for (std::size_t i = 0; i < trial.objects.size(); ++i) {
    trial.objects[i].map.label = i == 1 ? "B" : "A";
  }
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
  Trial trial = make_trial({15, 14, 12}, 911);
  for (std::size_t i = 0; i < trial.objects.size(); ++i) {
    trial.objects[i].map.label = i == 1 ? "B" : "A";
  }
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
  for (const Touch& touch : touches) {
    posterior.update(std::span(&touch, 1));
  }
  EXPECT_EQ(posterior.estimate().certificate->bins_evaluated,
            grown.estimate.certificate->bins_evaluated);
  posterior.reset();
  posterior.update(std::span(touches).first(1));
  EXPECT_LE(expect_certified(
                posterior, trial.objects, trial.options,
                reference_posterior(trial.objects, trial.options, std::span(touches).first(1)))
                .widest_nats,
            0.001);
  // A touch that tells nothing does not count.
  const std::int64_t bins = posterior.estimate().certificate->bins_evaluated;
  const std::vector<double> nothing(touches.front().pressure.size(),
                                    std::numeric_limits<double>::quiet_NaN());
  Touch silent = touches.front();
  silent.pressure = nothing;
  posterior.update(std::span(&silent, 1));
  EXPECT_EQ(posterior.estimate().certificate->bins_evaluated, bins);
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

}  // namespace palpate::certificate_law_test
