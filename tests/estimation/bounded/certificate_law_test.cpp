// The certificate against the posterior over all bins in float64, over many unknowns, and a
// posterior's answer, of which every bit is the same on every processor.

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "palpate/bounded_posterior.hpp"
#include "support/certified.hpp"
#include "support/every_set_of_instructions.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"
#include "support/touched_shape.hpp"
#include "support/trials.hpp"

namespace palpate::certificate_law_test {

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

/// All that a posterior tells after each of some touches, the counts of its search included.
std::vector<std::vector<double>> told_after_each(const Trial& trial) {
  BoundedPosterior posterior(trial.objects, trial.options);
  std::vector<std::vector<double>> told;
  for (std::size_t i = 0; i < trial.recording.size(); i += 3) {
    posterior.update(trial.recording.touches(i, std::min(i + 3, trial.recording.size())));
    const std::vector<std::vector<double>> now = told_by(posterior, trial.objects.size());
    told.insert(told.end(), now.begin(), now.end());
    const Certificate certificate = posterior.estimate().certificate.value();
    told.push_back({static_cast<double>(certificate.blocks_bounded),
                    static_cast<double>(certificate.bins_evaluated), posterior.entropy()});
    for (const PoseSample& sample : posterior.sample(9, 601)) {
      told.push_back({static_cast<double>(sample.object), sample.T_object_robot.translation_mm.x,
                      sample.T_object_robot.translation_mm.y, sample.T_object_robot.theta_rad});
    }
  }
  return told;
}

TEST(InstructionSets, GiveThePosteriorTheSameBits) {
  for (std::uint64_t i = 0; i < static_cast<std::uint64_t>(trials(4)); ++i) {
    SCOPED_TRACE(testing::Message() << "trial " << i);
    Trial trial = make_trial({20, 19, 16}, 602 + i);
    if (i == 1) {
      trial.options.none_weight = 1.0;
      trial.options.evidence_nats = 0.1;
    }
    std::optional<std::vector<std::vector<double>>> plain;
    with_every_set_of_instructions([&](const std::string& name) {
      EXPECT_EQ(vector_instructions(), name);
      const std::vector<std::vector<double>> told = told_after_each(trial);
      EXPECT_EQ(told, plain.value_or(told)) << name;
      plain = told;
    });
  }
}

}  // namespace palpate::certificate_law_test
