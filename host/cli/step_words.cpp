#include "cli/step_words.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "model/angle_unit.hpp"
#include "model/option_words.hpp"
#include "model/printable.hpp"
#include "recognition/record_json.hpp"

namespace palpate::cli {

namespace {

/// Two decimals, without the sign of "-0.00".
std::string two_decimals(double value) {
  const std::string text = fmt::format("{:.2f}", value);
  return text == "-0.00" ? "0.00" : text;
}

/// The label of the object that the pose belongs to.
const std::string& posed_label(const RecognitionStep& step, const RecognitionTask& task) {
  return task.labels[task.label_of[static_cast<std::size_t>(step.mode.object)]];
}

/// x and y in mm and theta in degrees, each followed by its deviation after `plus_minus`.
std::array<std::string, 3> numbers(const Pose& pose, const StandardDeviations& sd,
                                   const char* plus_minus) {
  const auto text = [&](double value, std::size_t axis, double (*unit)(double)) {
    return two_decimals(unit(value)) + (sd ? plus_minus + two_decimals(unit((*sd)[axis])) : "");
  };
  const auto mm = [](double length_mm) { return length_mm; };
  return {text(pose.translation_mm.x, 0, mm), text(pose.translation_mm.y, 1, mm),
          text(pose.theta_rad, 2, degrees)};
}

std::string decision_words(const Decision& decision) {
  const auto& [act, because] = decision;
  return because.empty() ? "" : printable((act ? "act: " : "do not act: ") + because);
}

std::string truth_words(const RecognitionStep& step) {
  if (step.truth.label.empty()) {
    return "";
  }
  std::string words = "truth: " + printable(step.truth.label);
  if (const std::optional<Pose> truth = step.true_T_robot_object()) {
    words +=
        fmt::format(" at {}; error {} mm", pose_words(*truth), error_text(step.pose_error_mm()));
  }
  return words;
}

/// Bounds that prove less than their tolerance asks for: those of the best label's probability, how
/// much of the belief is unproven, and what ended the search. "" where they prove enough.
std::string unproven_sentence(const RecognitionStep& step, const RecognitionTask& task) {
  const FilterTraits traits = traits_of(task.filter);
  if (!traits.tolerance || !step.certificate) {
    return "";
  }
  const auto [low, high] = step.identity_bounds[step.best];
  const bool proven = step.certificate->dropped_mass <= *traits.tolerance;
  // "(none)" has searches of its own, whose end a budget may not await.
  constexpr double told = 0.05;
  if (proven && (!traits.budget_s || high - low <= told)) {
    return "";
  }
  const double unproven = 100.0 * step.certificate->dropped_mass;
  const auto* bounded = std::get_if<BoundedOptions>(&task.filter);
  const bool gave_up = bounded != nullptr && bounded->poor_bins &&
                       step.certificate->bins_evaluated >= *bounded->poor_bins;
  const std::string left =
      fmt::format("{} left {} unproven",
                  traits.budget_s ? fmt::format("the budget of {:g} ms", 1e3 * *traits.budget_s)
                  : gave_up       ? "the search, which met nothing but poor fits,"
                                  : "rounding",
                  proven             ? "the probability of (none)"
                  : unproven >= 9.95 ? fmt::format("{:.0f} % of the belief", unproven)
                                     : fmt::format("{:.2g} % of the belief", unproven));
  // Bounds round outwards.
  return fmt::format("{} {:.1f} % (at least {:.1f} %, at most {:.1f} %): {}",
                     printable(task.labels[step.best]), 100.0 * step.confidence(),
                     std::floor(1000.0 * low) / 10.0, std::ceil(1000.0 * high) / 10.0, left);
}

/// Touches that do not fit; "" where they fit or are doubtful.
std::string misfit_sentence(const RecognitionStep& step, const RecognitionTask& task) {
  if (!step.fit || step.fit->verdict != Verdict::does_not_fit) {
    return "";
  }
  const std::string label = printable(posed_label(step, task));
  return fmt::format("unlike {}: its {} {:.0f} standard deviations worse than touches of {} do",
                     label,
                     step.touches == 1 ? "touch fits" : fmt::format("{} touches fit", step.touches),
                     -step.fit->z, label);
}

/// That "(none)" has a weight, but a single touch and no sensor model that tells what one touch
/// says of it; else "".
std::string single_touch_sentence(const RecognitionStep& step, const RecognitionTask& task) {
  if (step.touches != 1 || task.labels.back() != none_label ||
      task.fit_scale().stranger_single_touch) {
    return "";
  }
  return "one touch cannot tell whether the object is one of the maps': the odds of (none) are "
         "about the prior's";
}

}  // namespace

std::array<std::string, 3> pose_cells(const Pose& T_robot_object, const StandardDeviations& sd) {
  return numbers(T_robot_object, sd, "+-");
}

std::string pose_words(const Pose& T_robot_object, const StandardDeviations& sd) {
  const auto [x, y, theta] = numbers(T_robot_object, sd, " +-");
  return fmt::format("x {} mm, y {} mm, theta {} deg", x, y, theta);
}

StandardDeviations sd_at_peak(const RecognitionStep& step) {
  return step.places.peak ? step.sd() : std::nullopt;
}

std::string identity_words(const RecognitionStep& step, const RecognitionTask& task) {
  // "(none)" itself says that the touches are unlike the object.
  const bool unlike = step.fit && step.fit->verdict == Verdict::does_not_fit &&
                      task.labels[step.best] != none_label;
  const std::string& best = task.labels[step.best];
  const std::string object = printable(task.name_of(step.mode.object));
  const std::optional<double> share = share_at_pose(step, task);
  const std::string there = share ? fmt::format("{:.1f} % there", 100.0 * *share) : "";
  return best == posed_label(step, task)
             ? fmt::format("{}{} ({:.1f} %{})", unlike ? "unlike " : "", object,
                           100.0 * step.confidence(), share ? ", " + there : "")
             : fmt::format("{}{} ({:.1f} %), pose of {}{}", unlike ? "unlike " : "",
                           printable(best), 100.0 * step.confidence(), object,
                           share ? " (" + there + ")" : "");
}

std::optional<double> share_at_pose(const RecognitionStep& step, const RecognitionTask& task) {
  constexpr double nearly_all = 0.95;
  const bool there = task.labels[step.best] == posed_label(step, task) &&
                     step.places.share >= nearly_all * step.confidence();
  return there ? std::nullopt : std::optional(step.places.share);
}

std::vector<BeliefMode> other_modes(const RecognitionStep& step) {
  constexpr double least = 0.05;
  std::vector<BeliefMode> others;
  for (std::size_t i = 0; i < step.places.modes.size(); ++i) {
    if (i != step.places.own && step.places.modes[i].probability >= least) {
      others.push_back(step.places.modes[i]);
    }
  }
  return others;
}

std::string result_words(const RecognitionStep& step, const RecognitionTask& task) {
  return identity_words(step, task) + ": " + pose_words(step.T_robot_object(), sd_at_peak(step));
}

std::string error_text(std::optional<double> error_mm) {
  return error_mm ? fmt::format("{:.2f}", *error_mm) : "-";
}

StepSentences sentences_of(const RecognitionStep& step, const RecognitionTask& task) {
  StepSentences words{.decision = decision_words(step.decision), .truth = truth_words(step)};
  if (step.contradicted) {
    words.findings.emplace_back(
        "contradicted: no map explains these touches at any pose tried; the object may be unknown, "
        "its pose outside the region, or gamma too small");
  }
  words.findings.push_back(unproven_sentence(step, task));
  words.findings.push_back(misfit_sentence(step, task));
  for (const std::string& warning : step.warnings) {
    words.findings.push_back(printable(in_flags(warning)));
  }
  words.findings.push_back(single_touch_sentence(step, task));
  std::erase(words.findings, "");
  return words;
}

std::string gain_text(const TouchGain& gain, PlanGoal goal) {
  const TouchGain::StandardError& of = gain.standard_error;
  const double error = goal == PlanGoal::identity ? of.identity
                       : goal == PlanGoal::pose   ? of.pose
                                                  : of.both;
  return fmt::format("{:.2f}+-{:.2f}", gain_for(gain, goal), error);
}

std::string next_touch_words(const PlannedTouch& touch, PlanGoal goal) {
  if (gain_for(touch.gain, goal) < least_gain_nats) {
    return fmt::format("no candidate tells anything about the {}",
                       goal == PlanGoal::both ? "object or its pose" : goal_word(goal));
  }
  return fmt::format("touch next at {}: {} nats expected", pose_words(touch.T_robot_sensor),
                     gain_text(touch.gain, goal));
}

std::string setup_words(const RecognitionJob& job) {
  const RecognitionTask& task = job.task();
  const auto mirrored =
      static_cast<std::size_t>(std::ranges::count_if(task.hypotheses, &Hypothesis::mirrored));
  const std::size_t maps = task.hypotheses.size() - mirrored;
  return fmt::format("{} map{}{}{}, {}{}", maps, maps == 1 ? "" : "s",
                     mirrored > 0 ? fmt::format(" and {} mirrored", mirrored) : "",
                     task.sensor.file.empty() ? "" : " with " + printable(task.sensor.file),
                     size_words(task.filter),
                     task.uses_device() ? ", on " + job.device_name() : "");
}

void print_engine(const RecognitionJob& job, const Recogniser& recogniser) {
  const RecognitionTask& task = job.task();
  const PoseLattice& lattice = task.lattice();
  const auto words = [](const char* name, const Axis& axis, double unit, const char* unit_name) {
    return fmt::format("{} {:g} to {:g} {}, {} bins in steps of {:.4g}", name, axis.lower * unit,
                       axis.upper * unit, unit_name, axis.count, axis.step() * unit);
  };
  std::vector<std::string> filter = recogniser.filter().words();
  if (!task.filter_chosen_by.empty()) {
    filter.push_back("chosen by " + in_flags(task.filter_chosen_by));
  }
  std::string memory = job.device_name();
  if (task.uses_device()) {
    memory += fmt::format(", {:.1f} MiB of its memory",
                          static_cast<double>(recogniser.filter().device_bytes()) / (1 << 20));
  }
  fmt::print(stderr,
             "device: {}\nfilter: {}\nlattice: {}\n         {}\n"
             "         {}\n         pivot {}\n",
             memory, fmt::join(filter, "\n        "), words("x", lattice.x_mm, 1.0, "mm"),
             words("y", lattice.y_mm, 1.0, "mm"),
             words("theta", lattice.theta_rad, degrees(1.0), "deg"),
             task.auto_pivot ? "at the array's centre at the first touch in contact"
                             : fmt::format("{:g}, {:g} mm in the robot frame", lattice.pivot_mm.x,
                                           lattice.pivot_mm.y));
}

}  // namespace palpate::cli
