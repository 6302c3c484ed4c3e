// A posterior's answer has the same bits on every processor.

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "certificate_trials.hpp"
#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "support/certified.hpp"
#include "support/every_set_of_instructions.hpp"
#include "support/trials.hpp"

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
      EXPECT_EQ(BinLikelihood::instructions(), name);
      const std::vector<std::vector<double>> told = told_after_each(trial);
      EXPECT_EQ(told, plain.value_or(told)) << name;
      plain = told;
    });
  }
}

}  // namespace palpate::instruction_sets_test
