#include "recognition/recognition_record.hpp"

#include <algorithm>
#include <chrono>
#include <functional>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "estimation/lattice/refinement.hpp"
#include "palpate/error.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose_error.hpp"
#include "recognition/decision.hpp"
#include "recognition/label_probability.hpp"
#include "recognition/scales.hpp"

namespace palpate {

namespace {

/// Pose errors (Eq. 17-20), where the mode's object has the true label and the true pose is known.
void measure_errors(const RecognitionTask& task, RecognitionStep& step) {
  const Hypothesis& object = task.hypotheses[step.mode.object];
  if (object.mirrored || !step.truth.T_object_robot || object.map.label != step.truth.label ||
      !step.body) {
    return;
  }
  const auto error_mm = [&](const Pose& T_object_robot) {
    return pose_error_mm(*step.body, step.symmetry, T_object_robot, *step.truth.T_object_robot);
  };
  step.error_mm = error_mm(step.mode.T_object_robot);
  if (step.refined) {
    step.refined_error_mm = error_mm(step.refined->T_object_robot);
  }
}

/// The truth in the object frame of its label's map.
PartialTruth in_frame_of_map(const RecognitionTask& task, PartialTruth truth) {
  const auto object = std::ranges::find(task.hypotheses, truth.label,
                                        [](const Hypothesis& one) { return one.map.label; });
  if (truth.T_object_robot && object != task.hypotheses.end()) {
    truth.T_object_robot = in_centred_frame(object->map, *truth.T_object_robot);
  }
  return truth;
}

/// RecognitionStep::refined
std::optional<RefinedPose> refined_near(const Mode& mode, const Recogniser& recogniser,
                                        const RecognitionTask& task) {
  const std::optional<RefinedPose> refined = recogniser.filter().refine(mode);
  return refined
             ? std::optional(on_scale(task, recogniser.evidence(),
                                      displaced_body(task.hypotheses[mode.object].map), *refined))
             : std::nullopt;
}

/// The estimate after more touches.
Estimate estimate_after(Recogniser& recogniser, const RecognitionTask& task,
                        std::span<const Touch> touches, const std::function<void(double)>& progress,
                        std::optional<double> tolerance) {
  // Bounds only keep the touches, and search when they are asked for the estimate.
  const bool searches = traits_of(task.filter).certificate;
  recogniser.update(touches, searches ? std::function<void(double)>() : progress);
  return recogniser.estimate(tolerance);
}

/// Updates the belief with more touches, and tells the identity alone.
RecognitionStep identity_after(Recogniser& recogniser, const RecognitionTask& task,
                               std::span<const Touch> touches,
                               const std::function<void(double)>& progress) {
  const Estimate estimate =
      estimate_after(recogniser, task, touches, progress, task.drawn_tolerance);
  return judge(estimate, {}, task, recogniser.evidence(),
               refined_near(estimate.mode, recogniser, task));
}

/// What to say where symmetry_told() takes turns as equal that the map does not; else none.
std::optional<std::string> turned_alike(const RecognitionTask& task, const RecognitionStep& step) {
  const OccupancyGrid& map = task.hypotheses[step.mode.object].map;
  const int n = step.symmetry;
  if (n == map.symmetry) {
    return {};
  }
  return fmt::format(
      "{} looks the same after {}, and the touches do not tell such turns apart: they count as "
      "equal; build its map with `symmetry {}` where they always are, with `symmetry 1` where they "
      "never are",
      map.label, n == 0 ? "any turn" : fmt::format("every 1/{} of a turn", n), n);
}

/// The touches, from 0, that disagree where all others fit the mode's object at the pose: by
/// touch_fit, a third of them at most, and the others are three or more in contact. Else none.
std::vector<std::size_t> unlike_touches(std::span<const TouchEvidence> touches,
                                        const RecognitionTask& task, const RecognitionStep& step) {
  constexpr double unlike_z = -8.0;
  constexpr double others_from_z = -5.0;
  // A stranger's few touches may agree by chance.
  const std::size_t least_others = task.labels[step.best] == none_label ? 7 : 3;
  std::vector<std::size_t> unlike;
  std::size_t others = 0;
  for (std::size_t i = 0; i < step.touch_fit.size(); ++i) {
    const std::optional<double>& z = step.touch_fit[i];
    if (z && *z < unlike_z) {
      unlike.push_back(i);
    } else if (z && *z < others_from_z) {
      return {};  // where many fit badly, none stands out
    } else if (z && touches[i].in_contact()) {
      ++others;
    }
  }
  return others < std::max(least_others, 2 * unlike.size()) ? std::vector<std::size_t>() : unlike;
}

/// What to say of these touches.
/// @param last whether no other touch that tells anything comes after the first of them
std::string unlike_words(std::span<const std::size_t> unlike, bool last,
                         const RecognitionTask& task, const RecognitionStep& step) {
  double lowest_z = 0.0;
  std::vector<std::size_t> numbers;
  for (const std::size_t touch : unlike) {
    lowest_z = std::min(lowest_z, *step.touch_fit[touch]);
    numbers.push_back(touch + 1);
  }
  const std::string name = task.name_of(step.mode.object);
  const bool one = unlike.size() == 1;
  return fmt::format(
      "touch{} {} fit{} {} {:.0f} standard deviations worse than touches of {} do, while the "
      "others "
      "fit: {}",
      one ? "" : "es", fmt::join(numbers, ", "), one ? "s" : "", name, -lowest_z, name,
      last  ? "did the object move, or does the array touch something else?"
      : one ? "leave it out, or look at its pose"
            : "leave them out, or look at their poses");
}

/// Warns where a learned object explains the touches only if they lie elsewhere than the robot
/// says, or if the object moved, which forbids to act; and of single touches that disagree with the
/// others.
void doubt_places(const Recogniser& recogniser, const Estimate& estimate,
                  const RecognitionTask& task, RecognitionStep& step) {
  const std::span<const TouchEvidence> touches = recogniser.evidence();
  const auto placement = judge_placement(recogniser, estimate, task, step);
  const bool unexplained = step.fit && step.fit->verdict == Verdict::does_not_fit;
  if (!placement && !unexplained) {
    return;
  }
  const std::vector<std::size_t> unlike = unlike_touches(touches, task, step);
  const auto are_all_from = [&](std::size_t first) {
    return std::ranges::count_if(touches.subspan(first), &TouchEvidence::tells) ==
           std::ssize(unlike);
  };
  // One touch that is far off looks as if all were a little, or as if the object had moved, but
  // for the fits of the others.
  const bool all_after_a_move = placement && are_all_from(placement->moved_after);
  if (placement && (unlike.empty() || all_after_a_move)) {
    const auto [finding, remedy] = words_of(*placement, task);
    step.decision = {false, finding};
    step.warnings.push_back(finding + ": " + remedy);
  } else if (!unlike.empty()) {
    step.warnings.push_back(unlike_words(unlike, are_all_from(unlike.front()), task, step));
    if (placement) {
      step.decision = {false, step.warnings.back()};
    }
  }
}

/// T_robot_object from T_object_robot, theta in [-pi, pi).
Pose robot_pose(const Pose& T_object_robot) {
  Pose T_robot_object = inverse(T_object_robot);
  T_robot_object.theta_rad = wrap_angle(T_robot_object.theta_rad, 2.0 * std::numbers::pi);
  return T_robot_object;
}

}  // namespace

Pose RecognitionStep::T_robot_object() const {
  return robot_pose(least_turned(body, symmetry, pose()));
}

Pose RecognitionStep::mode_T_robot_object() const {
  return robot_pose(least_turned(body, symmetry, mode.T_object_robot));
}

std::optional<std::array<double, 3>> RecognitionStep::sd() const {
  return refined ? std::optional(inverse(least_turned(body, symmetry, *refined)).sd())
                 : std::nullopt;
}

std::optional<Pose> RecognitionStep::true_T_robot_object() const {
  return error_mm ? std::optional(robot_pose(nearest_equal_pose(
                        body.value(), symmetry, least_turned(body, symmetry, pose()),
                        *truth.T_object_robot)))
                  : std::nullopt;
}

PartialTruth partial_truth(const std::string& object, const std::optional<Truth>& truth) {
  return truth ? PartialTruth{truth->object, truth->T_object_robot} : PartialTruth{object, {}};
}

void RecognitionRecord::require_steps() const {
  if (!error.empty()) {
    throw Error(Fault::input, error);
  }
}

RecognitionStep judge(const Estimate& estimate, const PartialTruth& truth,
                      const RecognitionTask& task, std::span<const TouchEvidence> touches,
                      const std::optional<RefinedPose>& refined) {
  ObjectFit fit = fit_of(estimate.mode, refined, touches, task);
  const Tempering tempering = tempering_of(touches, task, fit.fit);
  RecognitionStep step{.touches = touches.size(),
                       .identity = label_probabilities(estimate, tempering, task),
                       .mode = estimate.mode,
                       .refined = refined,
                       .contradicted = estimate.contradicted,
                       .truth = in_frame_of_map(task, truth),
                       .symmetry = task.hypotheses[estimate.mode.object].map.symmetry,
                       .body = task.bodies[estimate.mode.object],
                       .fit = fit.fit,
                       .touch_fit = std::move(fit.touches)};
  if (estimate.certificate) {
    step.identity_bounds = label_bounds(estimate, step.identity, tempering, task);
    step.certificate = estimate.certificate;
  }
  step.best =
      static_cast<std::size_t>(std::ranges::max_element(step.identity) - step.identity.begin());
  if (!truth.label.empty()) {
    const bool learned = std::ranges::find(task.labels, truth.label) != task.labels.end();
    step.right = task.labels[step.best] == (learned ? truth.label : none_label);
  }
  measure_errors(task, step);
  return step;
}

RecognitionStep take_step(Recogniser& recogniser, const RecognitionTask& task,
                          std::span<const Touch> touches, const PartialTruth& truth,
                          const std::function<void(double)>& progress,
                          std::optional<double> tolerance) {
  const Estimate estimate = estimate_after(recogniser, task, touches, progress, tolerance);
  const std::span<const TouchEvidence> evidence = recogniser.evidence();
  RecognitionStep step =
      judge(estimate, truth, task, evidence, refined_near(estimate.mode, recogniser, task));
  step.symmetry = symmetry_told(recogniser, task, step);
  measure_errors(task, step);  // again, by the symmetry that is told
  step.effective_sample_size = recogniser.filter().effective_sample_size();
  step.places = places_of(recogniser, estimate, task, step);
  step.decision = decide(step, task);

  step.warnings = warnings_about(evidence, task, recogniser.lattice(), step);
  // What is wrong with the input may explain a poor result; before a robot acts, places are
  // doubted.
  const bool doubtful = step.warnings.empty() || step.decision.act;
  if (step.warnings.empty()) {
    if (auto warning = turned_alike(task, step)) {
      step.warnings.push_back(*std::move(warning));
    }
  }
  if (doubtful) {
    doubt_places(recogniser, estimate, task, step);
  }
  if (std::string words = recogniser.place_words(); !words.empty()) {
    step.warnings.push_back(std::move(words));
  }
  return step;
}

RecognitionRecord recognise(Recogniser& recogniser, const RecognitionTask& task,
                            const Query& unknown, bool trace,
                            const std::function<void(double)>& progress, bool drawn) {
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
  const std::span<const Touch> touches = unknown.touches;
  const std::size_t together = trace ? 1 : touches.size();
  bool progress_threw = false;  // its Error is the caller's, not the unknown's
  try {
    recogniser.reset();
    for (std::size_t done = 0; done < touches.size(); done += together) {
      const auto show = [&](double fraction) {
        progress_threw = true;
        progress((static_cast<double>(done) + fraction * static_cast<double>(together)) /
                 static_cast<double>(touches.size()));
        progress_threw = false;
      };
      const std::size_t left = touches.size() - done - together;
      const std::span<const Touch> next = touches.subspan(done, together);
      const std::function<void(double)> shown =
          progress ? std::function<void(double)>(show) : std::function<void(double)>();
      record.trace.push_back(drawn && left > 0
                                 ? identity_after(recogniser, task, next, shown)
                                 : take_step(recogniser, task, next, unknown.truth, shown,
                                             left == 0 ? std::nullopt : task.trace_tolerance));
      if (progress && traits_of(task.filter).certificate) {
        show(1.0);
      }
    }
  } catch (const Error& error) {
    if (progress_threw || error.fault() != Fault::input) {
      throw;
    }
    record.trace.clear();
    record.error = fmt::format("{}: {}", unknown.recording, error.what());
  }
  record.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return record;
}

}  // namespace palpate
