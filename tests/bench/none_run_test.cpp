#include "none_run.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "letters.hpp"
#include "palpate/device.hpp"
#include "palpate/pose_histogram.hpp"
#include "trials.hpp"

namespace palpate::bench {
namespace {

/// Whether a histogram that has the hypothesis finds it the most probable.
bool called_none(Device& device, const std::vector<Hypothesis>& letters, const Recording& trial,
                 int touches, double log10_weight) {
  PoseHistogram histogram(device, letters,
                          HistogramOptions{.lattice = lattice_of(10, 10, 8),
                                           .none_weight = std::pow(10.0, log10_weight)});
  histogram.update(trial.touches(0, touches));
  const Estimate estimate = histogram.estimate();
  return estimate.none > *std::max_element(estimate.identity.begin(), estimate.identity.end());
}

// What is worked out for every weight from one belief is what the library says at that weight.
TEST(NoneRun, TurnsWhereTheHistogramDoes) {
  Device device = Device::open();
  const std::vector<Hypothesis> letters = letter_maps(device, training_recordings(), MapOptions{});
  const std::vector<std::string> letter = {"E"};
  const std::vector<std::string> shape = {"ring"};
  const std::vector<Recording> known = make_trials(letter, 1, 4, 3);
  const std::vector<Recording> unlearned = make_trials(shape, 1, 4, 4);
  const int touches[] = {1, 4};
  const std::vector<NoneRun> runs =
      run_none(device, letters, known, unlearned, lattice_of(10, 10, 8), touches);
  ASSERT_EQ(runs.size(), 2U);
  for (const NoneRun& run : runs) {
    for (const auto& [trial, log10_weight] :
         {std::pair(known[0], run.learned_log10_weight.at(0)),
          std::pair(unlearned[0], run.unlearned_log10_weight.at(0))}) {
      // The belief is exact to 1e-4 nats a touch.
      EXPECT_TRUE(called_none(device, letters, trial, run.touches, log10_weight + 0.001));
      EXPECT_FALSE(called_none(device, letters, trial, run.touches, log10_weight - 0.001));
    }
  }
}

}  // namespace
}  // namespace palpate::bench
