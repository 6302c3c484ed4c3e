#include "plan_run.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "measurement.hpp"
#include "palpate/simulation.hpp"

namespace palpate::bench {

namespace {

constexpr std::uint64_t trial_seed = 950'000'000;

/// Index of the candidate of the largest expected gain about object and pose together.
std::size_t best_of(const PoseHistogram& histogram, const Recording& test_set,
                    std::span<const std::size_t> candidates, std::uint64_t seed) {
  std::vector<Pose> T_robot_sensor;
  for (const std::size_t candidate : candidates) {
    T_robot_sensor.push_back(test_set.T_robot_sensor[candidate]);
  }
  const std::vector<TouchGain> gains =
      histogram.expected_gain(T_robot_sensor, test_set.elements_mm, {.seed = seed});
  const auto best = std::ranges::max_element(gains, {}, &TouchGain::both);
  return static_cast<std::size_t>(best - gains.begin());
}

double log_loss(const PoseHistogram& histogram, const RecognitionTask& task,
                const Recording& test_set) {
  const auto object = std::ranges::find(task.labels, test_set.truth->object) - task.labels.begin();
  const double probability =
      histogram.estimate().identity[static_cast<std::size_t>(task.label_of[object])];
  return -std::log(std::max(probability, std::numeric_limits<double>::min()));
}

PlanTrial run_trial(PoseHistogram& histogram, const RecognitionTask& task,
                    const Recording& test_set, int touches, std::uint64_t seed) {
  PlanTrial trial;
  histogram.reset();
  for (int touch = 0; touch < touches; ++touch) {
    histogram.update(test_set.touch(static_cast<std::size_t>(touch)));
    trial.random_nats.push_back(histogram.entropy());
    trial.random_log_loss.push_back(log_loss(histogram, task, test_set));
  }
  histogram.reset();
  std::vector<std::size_t> candidates(test_set.size());
  std::iota(candidates.begin(), candidates.end(), 0);
  std::size_t next = 0;  // the first touch is the random one
  for (int touch = 0; touch < touches; ++touch) {
    if (touch > 0) {
      trial.plan_seconds.push_back(
          seconds_of([&] { next = best_of(histogram, test_set, candidates, seed + touch); }));
    }
    histogram.update(test_set.touch(candidates[next]));
    candidates.erase(candidates.begin() + static_cast<std::ptrdiff_t>(next));
    trial.planned_nats.push_back(histogram.entropy());
    trial.planned_log_loss.push_back(log_loss(histogram, task, test_set));
  }
  return trial;
}

}  // namespace

std::vector<PlanTrial> run_plan(Device& device, const std::vector<Hypothesis>& letters,
                                const PlanSetting& setting) {
  const RecognitionTask task(letters, HistogramOptions{.lattice = setting.lattice});
  PoseHistogram histogram = histogram_of(device, task);
  std::vector<PlanTrial> trials;
  std::uint64_t seed = 1;
  const auto whole_set = static_cast<int>(training_grid().size());
  for (const Recording& test_set :
       make_trials(vowels, setting.trials_each, whole_set, trial_seed)) {
    trials.push_back(run_trial(histogram, task, test_set, setting.touches, seed));
    seed += whole_set;
  }
  return trials;
}

}  // namespace palpate::bench
