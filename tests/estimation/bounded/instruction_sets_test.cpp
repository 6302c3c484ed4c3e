// A posterior's answer has the same bits on every processor.

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "bounded/certificate_trials.hpp"
#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "support/every_set_of_instructions.hpp"

namespace palpate::instruction_sets_test {

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
    std::vector<double> drawn;
    for (const PoseSample& sample : posterior.sample(9, 601)) {
      drawn.insert(drawn.end(),
                   {static_cast<double>(sample.object), sample.T_object_robot.translation_mm.x,
                    sample.T_object_robot.translation_mm.y, sample.T_object_robot.theta_rad});
    }
    told.push_back(drawn);
  }
  return told;
}

void expect_same_bits(const Trial& trial) {
  std::optional<std::vector<std::vector<double>>> plain;
  with_every_set_of_instructions([&](const std::string& name) {
    EXPECT_EQ(BinLikelihood::instructions(), name);
    const std::vector<std::vector<double>> told = told_after_each(trial);
    if (plain) {
      EXPECT_EQ(told, *plain) << name;
    } else {
      plain = told;
    }
  });
}

TEST(InstructionSets, GiveThePosteriorTheSameBits) {
  for (std::uint64_t seed = 602; seed < 610; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    expect_same_bits(make_trial({25, 24, 16}, seed));
  }
}

TEST(InstructionSets, GiveThePosteriorTheSameBitsWithNoneOfThese) {
  Trial trial = make_trial({25, 24, 16}, 611);
  trial.options.none_weight = 1.0;
  trial.options.evidence_nats = 0.1;
  expect_same_bits(trial);
}

}  // namespace palpate::instruction_sets_test
