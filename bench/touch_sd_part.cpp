#include <array>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "beliefs_parts.hpp"
#include "measurement.hpp"
#include "recognition/touch_sd_fit.hpp"
#include "trials.hpp"

namespace palpate::bench {

namespace {

constexpr std::uint64_t trial_seed = 970'000'000;
constexpr std::uint64_t seeds_per_sd = 5'000'000;  ///< every misplacement has unknowns of its own
constexpr double most_off = 20.0;                  ///< % of the true standard deviation

/// Unknowns whose touches are misplaced by these standard deviations.
struct Misplacement {
  DisplacementSd sd;
  std::size_t index;  ///< in the list of all
};

Json json_of(const DisplacementSd& sd) { return {{"mm", sd.mm}, {"rad", sd.rad}}; }

/// One of the two standard deviations: fitted, its standard error, and how far off.
void add(Case& result, const std::string& name, double true_sd, double fitted, double error,
         const char* unit) {
  result.measurements.push_back({name + ", fitted", fitted, unit});
  result.measurements.push_back({name + ", standard error", error, unit});
  if (true_sd > 0.0) {
    result.measurements.push_back({name + ", fitted over true", fitted / true_sd, "of 1"});
    result.measurements.push_back(
        {name + ", off by", 100.0 * std::abs(fitted / true_sd - 1.0), "%", at_most(most_off)});
  }
}

Json measure(const BeliefInputs& inputs, const Misplacement& misplacement, Report& report) {
  const bool quick = inputs.options.quick;
  const DisplacementSd& sd = misplacement.sd;
  const int touches = quick ? 6 : 12;
  const std::vector<Recording> trials = make_trials(
      vowels, inputs.trials_each(10, 2), touches, trial_seed + misplacement.index * seeds_per_sd,
      {.at_random_poses = true, .pose_noise = {sd.mm, sd.rad}});
  std::vector<TouchedObject> unknowns;
  for (const Recording& trial : trials) {
    unknowns.push_back({.name = trial.path, .touches = all_touches(trial)});
  }
  const RecognitionTask task(
      inputs.letters,
      HistogramOptions{.lattice = quick ? lattice_of(13, 13, 55) : lattice_of(20, 20, 64)});
  TouchSdFit fit;
  const double seconds = seconds_of([&] { fit = fit_touch_sd(inputs.device, task, unknowns); });
  Case result{.name = fmt::format("fit of touch-sd, true {} mm, {} rad", sd.mm, sd.rad),
              .facts = {{"unknowns", unknowns.size()},
                        {"touches", touches},
                        {"bins", size_of(std::get<HistogramOptions>(task.filter).lattice)}}};
  add(result, "along x and y", sd.mm, fit.sd.mm, fit.standard_error.mm, "mm");
  add(result, "angle", sd.rad, fit.sd.rad, fit.standard_error.rad, "rad");
  result.measurements.push_back({"log evidence above exact poses'", fit.evidence_gain, "nats"});
  result.measurements.push_back({"time", seconds, "s"});
  report.add(result);
  return {{"true", json_of(sd)},
          {"fitted", json_of(fit.sd)},
          {"standard_error", json_of(fit.standard_error)},
          {"gain_nats", fit.evidence_gain},
          {"unknowns", unknowns.size()},
          {"touches", touches},
          {"warnings", fit.warnings}};
}

}  // namespace

Json measure_touch_sd(const BeliefInputs& inputs, Report& report) {
  constexpr double rad_per_mm = 0.05;
  constexpr std::array<double, 5> all_mm{0.3, 0.5, 1.0, 2.0, 0.0};
  constexpr double quick_mm = 1.0;
  Json records = Json::array();
  for (std::size_t i = 0; i < all_mm.size(); ++i) {
    const double mm = all_mm[i];
    if (!inputs.options.quick || mm == quick_mm) {
      records.push_back(measure(inputs, {.sd = {mm, rad_per_mm * mm}, .index = i}, report));
    }
  }
  return records;
}

}  // namespace palpate::bench
