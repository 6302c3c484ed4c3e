#include "judged_belief.hpp"

#include "palpate/pose_error.hpp"

namespace palpate::bench {

PoseHistogram histogram_of(Device& device, const RecognitionTask& task) {
  return {device, task.hypotheses, std::get<HistogramOptions>(task.filter)};
}

RecognitionStep judged_belief(const PoseHistogram& histogram, const RecognitionTask& task,
                              const GroundTruth& truth) {
  RecognitionStep step = judge(histogram.estimate(), truth, task);
  step.refined = histogram.refine(step.mode);
  if (step.error_mm) {
    const OccupancyGrid& map = task.hypotheses[static_cast<std::size_t>(step.mode.object)].map;
    step.refined_error_mm = pose_error_mm(body_of(map), map.symmetry, step.refined->T_object_robot,
                                          *truth.T_object_robot);
  }
  return step;
}

std::vector<RecognitionStep> steps_after(PoseHistogram& histogram, const RecognitionTask& task,
                                         const Recording& trial, std::span<const int> touches) {
  histogram.reset();
  std::vector<RecognitionStep> steps;
  std::size_t done = 0;
  for (const int count : touches) {
    const auto until = static_cast<std::size_t>(count);
    histogram.update(trial.touches(done, until));
    steps.push_back(judged_belief(histogram, task, ground_truth(trial.object, trial.truth)));
    done = until;
  }
  return steps;
}

}  // namespace palpate::bench
