#include "misplaced_run.hpp"

#include <algorithm>
#include <cmath>

#include "normalised_error.hpp"

namespace palpate::bench {

namespace {

/// The smallest probability whose logarithm a double still has at full precision.
constexpr double least_probability = 1e-300;

}  // namespace

void BeliefErrors::add(const RecognitionTask& task, const RecognitionStep& step) {
  const auto label = std::ranges::find(task.labels, step.truth.label) - task.labels.begin();
  right += *step.right ? 1 : 0;
  log_loss.push_back(
      -std::log(std::max(step.identity[static_cast<std::size_t>(label)], least_probability)));
  pose.add(step);
  normalised.emplace_back();
  if (step.refined_error_mm) {
    normalised.back() =
        normalised_error(task.hypotheses[static_cast<std::size_t>(step.mode.object)].map,
                         *step.refined, *step.truth.T_object_robot);
  }
}

MisplacedRun::Paired MisplacedRun::refined() const {
  Paired paired;
  for (std::size_t i = 0; i < averaged.pose.refined_mm.size(); ++i) {
    if (as_if_exact.pose.refined_mm[i] && averaged.pose.refined_mm[i]) {
      paired.as_if_exact_mm.push_back(*as_if_exact.pose.refined_mm[i]);
      paired.averaged_mm.push_back(*averaged.pose.refined_mm[i]);
    }
  }
  return paired;
}

std::vector<MisplacedRun> run_misplaced(Device& device, const std::vector<Hypothesis>& letters,
                                        const MisplacedSetting& setting,
                                        std::span<const int> touches) {
  const std::vector<Recording> trials =
      make_trials(vowels, setting.trials_each, touches.back(), setting.seed,
                  {.at_random_poses = true, .pose_noise = setting.noise});
  std::vector<MisplacedRun> runs;
  for (const int count : touches) {
    runs.push_back({.touches = count});
  }
  const DisplacementSd sd{setting.noise.translation_mm, setting.noise.rotation_rad};
  for (const auto& [touch_sd, errors] : {std::pair(DisplacementSd{}, &MisplacedRun::as_if_exact),
                                         std::pair(sd, &MisplacedRun::averaged)}) {
    const RecognitionTask task(letters,
                               HistogramOptions{.lattice = setting.lattice, .touch_sd = touch_sd});
    PoseHistogram histogram = histogram_of(device, task);
    for (const Recording& trial : trials) {
      const std::vector<RecognitionStep> steps = steps_after(histogram, task, trial, touches);
      for (std::size_t i = 0; i < runs.size(); ++i) {
        (runs[i].*errors).add(task, steps[i]);
      }
    }
  }
  return runs;
}

}  // namespace palpate::bench
