#include <array>
#include <optional>

#include <fmt/format.h>

#include "beliefs_parts.hpp"
#include "bootstrap.hpp"
#include "misplaced_run.hpp"

namespace palpate::bench {

namespace {

constexpr std::uint64_t trial_seed = 500'000'000;
constexpr double most_error_ratio = 0.85;       ///< of the plain belief's, after 9 and 12 touches
constexpr double most_log_loss = 0.02;          ///< nats, after 5 touches
constexpr double least_normalised_error = 2.0;  ///< after 5, 9 and 12 touches
constexpr double most_normalised_error = 4.0;

/// The mean of some values and its bootstrap interval.
Measurement mean_of(const std::string& name, std::span<const double> values, const char* unit,
                    std::optional<Goal> goal = {}) {
  return {.name = name,
          .value = mean(values),
          .unit = unit,
          .goal = goal,
          .interval = bootstrap_mean_interval(values)};
}

Json record_of_mean(std::span<const double> values) {
  const Interval interval = bootstrap_mean_interval(values);
  return {{"mean", mean(values)}, {"low", interval.low}, {"high", interval.high}};
}

Json record_of(const MisplacedSetting& setting, int touches, const char* belief,
               const BeliefErrors& errors) {
  return {{"noise_mm", setting.noise.translation_mm},
          {"noise_rad", setting.noise.rotation_rad},
          {"touches", touches},
          {"belief", belief},
          {"right", errors.right},
          {"unknowns", errors.log_loss.size()},
          {"log_loss", record_of_mean(errors.log_loss)},
          {"mode_mm", record_of_mean(present(errors.pose.mode_mm))},
          {"refined_mm", record_of_mean(present(errors.pose.refined_mm))},
          {"normalised_error", record_of_mean(present(errors.normalised))}};
}

/// @param averaged whether goals hold: those of the averaged belief
void add_errors(Case& result, const std::string& belief, const BeliefErrors& errors, int touches,
                bool held_to_goals) {
  const auto add = [&](Measurement measurement) {
    measurement.name = belief + ": " + measurement.name;
    result.measurements.push_back(std::move(measurement));
  };
  const auto goal = [&](bool holds, Goal value) {
    return held_to_goals && holds ? std::optional(value) : std::nullopt;
  };
  add(share_of("right", errors.right, errors.log_loss.size()));
  add(mean_of("log-loss of identity", errors.log_loss, "nats",
              goal(touches == 5, at_most(most_log_loss))));
  add(mean_of("mode's error", present(errors.pose.mode_mm), "mm"));
  add(mean_of("refined error", present(errors.pose.refined_mm), "mm"));
  const std::vector<double> normalised = present(errors.normalised);
  add(mean_of("squared error over covariance", normalised, "of 3",
              goal(touches >= 5, at_most(most_normalised_error))));
  if (held_to_goals && touches >= 5) {
    add({"the same, at least", mean(normalised), "of 3", at_least(least_normalised_error)});
  }
  add({"the same, median", median(normalised), "of 2.4"});
}

Case case_of(const MisplacedSetting& setting, const MisplacedRun& run, bool held_to_goals) {
  Case result{.name = fmt::format("off by {} mm, {} rad, touch {}", setting.noise.translation_mm,
                                  setting.noise.rotation_rad, run.touches),
              .facts = {{"unknowns", run.averaged.log_loss.size()},
                        {"bins", fmt::format("{}", size_of(setting.lattice))}}};
  add_errors(result, "as if exact", run.as_if_exact, run.touches, false);
  add_errors(result, "averaged", run.averaged, run.touches, held_to_goals);
  const MisplacedRun::Paired paired = run.refined();
  Measurement ratio{
      .name = "refined error, averaged over as if exact",
      .value = mean(paired.averaged_mm) / mean(paired.as_if_exact_mm),
      .unit = "times",
      .interval = bootstrap_ratio_interval(paired.averaged_mm, paired.as_if_exact_mm)};
  if (held_to_goals && run.touches >= 9) {
    ratio.goal = at_most(most_error_ratio);
  }
  result.measurements.push_back(std::move(ratio));
  return result;
}

}  // namespace

Json measure_misplaced(const BeliefInputs& inputs, Report& report) {
  const bool quick = inputs.options.quick;
  constexpr std::array touches = {3, 5, 9, 12};
  Json records = Json::array();
  for (const SensorPoseNoise& noise : {SensorPoseNoise{1.0, 0.05}, SensorPoseNoise{2.0, 0.1}}) {
    const MisplacedSetting setting{
        .noise = noise,
        .lattice = quick ? lattice_of(13, 13, 55) : lattice_of(30, 30, 113),
        .trials_each = inputs.trials_each(40, 2),
        .seed = trial_seed};
    for (const MisplacedRun& run : run_misplaced(inputs.device, inputs.letters, setting, touches)) {
      report.add(case_of(setting, run, noise.translation_mm == 1.0));
      records.push_back(record_of(setting, run.touches, "as if exact", run.as_if_exact));
      records.push_back(record_of(setting, run.touches, "averaged", run.averaged));
    }
  }
  return records;
}

}  // namespace palpate::bench
