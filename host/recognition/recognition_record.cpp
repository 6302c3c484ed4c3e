#include "recognition_record.hpp"

#include <algorithm>
#include <chrono>

#include "palpate/error.hpp"

namespace palpate {

namespace {

/// Pose error of a hypothesis, where the truth is known and it is the true object.
std::optional<double> error_mm(const RecognitionTask& task, int object, const Pose& T_object_robot,
                               const GroundTruth& truth) {
  const OccupancyGrid& map = task.hypotheses[object].map;
  const std::optional<Body>& body = task.bodies[object];
  if (!truth.T_object_robot || map.label != truth.label || !body) {
    return {};
  }
  return pose_error_mm(*body, map.symmetry, T_object_robot, *truth.T_object_robot);
}

std::vector<RecognitionStep> steps_of(Recogniser& recogniser, const RecognitionTask& task,
                                      const Unknown& unknown, bool trace,
                                      const std::function<void(double)>& progress) {
  const std::span<const Touch> touches = unknown.touches;
  const std::size_t between = trace ? 1 : touches.size();
  std::size_t done = 0;
  std::function<void(double)> show;
  if (progress) {
    show = [&](double fraction) {
      progress((static_cast<double>(done) + fraction * static_cast<double>(between)) /
               static_cast<double>(touches.size()));
    };
  }
  std::vector<RecognitionStep> steps;
  recogniser.reset();
  for (; done < touches.size(); done += between) {
    recogniser.update(touches.subspan(done, between), show);
    steps.push_back(judge(recogniser, unknown.truth, task));
  }
  return steps;
}

}  // namespace

GroundTruth ground_truth(const std::string& object, const std::optional<Truth>& truth) {
  return truth ? GroundTruth{truth->object, truth->T_object_robot} : GroundTruth{object, {}};
}

Unknown unknown_of(const Recording& recording) {
  return {.recording = recording.path,
          .frame = {},
          .touches = recording.touches(0, recording.size()),
          .truth = ground_truth(recording.object, recording.truth)};
}

bool array_is_still(std::span<const Unknown> unknowns) {
  constexpr std::size_t large = 256;
  const auto is_press = [&](const Unknown& unknown) {
    return unknown.frame && unknown.touches.size() == 1 &&
           same_placement(unknown.touches.front(), unknowns.front().touches.front());
  };
  return unknowns.size() > 1 && std::all_of(unknowns.begin(), unknowns.end(), is_press) &&
         unknowns.front().touches.front().elements_mm.size() >= large;
}

void RecognitionRecord::require_steps() const {
  if (!error.empty()) {
    throw Error(Fault::input, error);
  }
}

RecognitionStep judge(const Estimate& estimate, const GroundTruth& truth,
                      const RecognitionTask& task) {
  const std::vector<std::string>& labels = task.labels;
  RecognitionStep step{.identity = std::vector<double>(labels.size()),
                       .mode = estimate.mode,
                       .refined = {},
                       .contradicted = estimate.contradicted};
  for (std::size_t i = 0; i < estimate.identity.size(); ++i) {
    step.identity[task.label_of[i]] += estimate.identity[i];
  }
  if (labels.back() == none_label) {
    step.identity.back() = estimate.none;
  }
  step.best = static_cast<std::size_t>(
      std::max_element(step.identity.begin(), step.identity.end()) - step.identity.begin());
  if (!truth.label.empty()) {
    const bool learned = std::find(labels.begin(), labels.end(), truth.label) != labels.end();
    step.right = labels[step.best] == (learned ? truth.label : none_label);
  }
  step.error_mm = error_mm(task, step.mode.object, step.mode.T_object_robot, truth);
  return step;
}

void add_refined(const RefinedPose& refined, const GroundTruth& truth, const RecognitionTask& task,
                 RecognitionStep& step) {
  step.refined = refined;
  step.refined_error_mm = error_mm(task, step.mode.object, refined.T_object_robot, truth);
}

RecognitionStep judge(const Recogniser& recogniser, const GroundTruth& truth,
                      const RecognitionTask& task) {
  RecognitionStep step = judge(recogniser.estimate(), truth, task);
  if (const std::optional<RefinedPose> refined = recogniser.refine(step.mode)) {
    add_refined(*refined, truth, task, step);
  }
  step.effective_sample_size = recogniser.effective_sample_size();
  return step;
}

RecognitionRecord recognise(Recogniser& recogniser, const RecognitionTask& task,
                            const Unknown& unknown, bool trace,
                            const std::function<void(double)>& progress) {
  RecognitionRecord record{.recording = unknown.recording,
                           .frame = unknown.frame,
                           .touches = unknown.touches.size(),
                           .true_label = unknown.truth.label,
                           .trace = {},
                           .error = unknown.error};
  if (record.error.empty() && unknown.touches.empty()) {
    record.error = unknown.recording + ": no touches";
  }
  if (!record.error.empty()) {
    return record;
  }
  const auto start = std::chrono::steady_clock::now();
  try {
    record.trace = steps_of(recogniser, task, unknown, trace, progress);
  } catch (const Error& error) {
    if (error.fault() != Fault::input) {
      throw;
    }
    record.error = error.what();
  }
  record.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return record;
}

}  // namespace palpate
