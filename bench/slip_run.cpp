#include "slip_run.hpp"

#include "model/random.hpp"
#include "palpate/pose_error.hpp"

namespace palpate::bench {

namespace {

constexpr std::uint64_t trial_seed = 800'000'000;
constexpr std::uint64_t walk_seed = 850'000'000;

std::vector<PoseErrors> errors_of(Device& device, const RecognitionTask& task,
                                  const std::vector<SlippingTrial>& trials, int touches) {
  std::vector<PoseErrors> errors(static_cast<std::size_t>(touches));
  PoseHistogram histogram = histogram_of(device, task);
  for (const SlippingTrial& trial : trials) {
    histogram.reset();
    for (std::size_t touch = 0; touch < errors.size(); ++touch) {
      histogram.update(trial.recording.touch(touch));
      errors[touch].add(judged_belief(
          histogram, task,
          {.label = trial.recording.object, .T_object_robot = trial.T_object_robot[touch]}));
    }
  }
  return errors;
}

}  // namespace

SlippingTrial slipping_trial(const Recording& trial, const glm::dvec2& centroid_mm,
                             const DisplacementSd& step, std::uint64_t seed) {
  const Pose T_object_robot_at_rest = trial.truth->T_object_robot;
  SlippingTrial slipping{.recording = trial, .T_object_robot = {}};
  slipping.recording.object = trial.truth->object;
  constexpr double nearer = 0.3;
  Pose T_object_robot{nearer * T_object_robot_at_rest.translation_mm,
                      T_object_robot_at_rest.theta_rad};
  slipping.recording.truth->T_object_robot = T_object_robot;
  Random random(seed, Stream::object_pose);
  for (Pose& T_robot_sensor : slipping.recording.T_robot_sensor) {
    if (!slipping.T_object_robot.empty()) {
      const double dx_mm = step.mm * random.normal();
      const double dy_mm = step.mm * random.normal();
      const double turn_rad = step.rad * random.normal();
      const Pose moved{glm::dvec2(dx_mm, dy_mm) + centroid_mm - rotate(turn_rad, centroid_mm),
                       turn_rad};
      T_object_robot = moved * T_object_robot;
    }
    const Pose T_object_sensor = T_object_robot_at_rest * T_robot_sensor;
    T_robot_sensor = inverse(T_object_robot) * T_object_sensor;
    slipping.T_object_robot.push_back(T_object_robot);
  }
  return slipping;
}

SlipRun run_slip(Device& device, const std::vector<Hypothesis>& letters,
                 const SlipSetting& setting) {
  std::vector<SlippingTrial> trials;
  std::uint64_t seed = walk_seed;
  for (const Recording& trial :
       make_trials(vowels, setting.trials_each, setting.touches, trial_seed)) {
    const std::size_t letter = trials.size() / static_cast<std::size_t>(setting.trials_each);
    trials.push_back(
        slipping_trial(trial, body_of(letters[letter].map).centroid_mm, setting.step, seed++));
  }
  const auto errors = [&](const DisplacementSd& slip_sd) {
    return errors_of(device,
                     {letters, HistogramOptions{.lattice = setting.lattice, .slip_sd = slip_sd}},
                     trials, setting.touches);
  };
  return {.followed = errors(setting.step), .at_rest = errors({})};
}

TrialErrors mean_mode_errors(const std::vector<PoseErrors>& errors, std::size_t from) {
  TrialErrors means(errors.front().mode_mm.size());
  for (std::size_t trial = 0; trial < means.size(); ++trial) {
    TrialErrors of_trial;
    for (const PoseErrors& touch : std::span(errors).subspan(from)) {
      of_trial.push_back(touch.mode_mm[trial]);
    }
    if (const std::optional<ErrorsOverTrials> over = errors_over(of_trial)) {
      means[trial] = over->mean_mm;
    }
  }
  return means;
}

double located(const std::vector<PoseErrors>& errors) {
  std::size_t right = 0;
  std::size_t all = 0;
  for (const PoseErrors& touch : errors) {
    for (const std::optional<double>& error_mm : touch.mode_mm) {
      right += error_mm ? 1 : 0;
      ++all;
    }
  }
  return static_cast<double>(right) / static_cast<double>(all);
}

}  // namespace palpate::bench
