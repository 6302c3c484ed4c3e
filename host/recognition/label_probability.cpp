#include "recognition/label_probability.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "estimation/hypotheses.hpp"

namespace palpate {

namespace {

/// That of z, of which one in ten spreads wider, where something else widens all of them.
double density(const Fit& fit, double mean, double more_sd) {
  constexpr double odd_share = 0.1;
  constexpr double odd_sd = 5.0;
  constexpr double farthest = 30.0;  // no density is 0
  const double from_mean = std::clamp(fit.z, -farthest, farthest) - mean;
  const auto normal = [&](double own_sd) {
    const double sd = std::hypot(own_sd, more_sd);
    return std::exp(-0.5 * from_mean * from_mean / (sd * sd)) / sd;
  };
  return (1.0 - odd_share) * normal(1.0) + odd_share * normal(odd_sd);
}

/// exp(a) / (exp(a) + exp(b)); 0 where both are 0
double share(double a, double b) { return a == log_zero ? 0.0 : 1.0 / (1.0 + std::exp(b - a)); }

/// What the presses' features say for every label, in nats: the features' weight times the sum over
/// the touches of the log density by the label's distribution above that by the distribution of any
/// object. Only touches with an element In Contact count. 0 for none_label, whose presses are those
/// of any object, and for all where the task has no features.
std::vector<double> feature_nats(std::span<const TouchEvidence> touches,
                                 const RecognitionTask& task) {
  std::vector<double> nats(task.labels.size());
  if (!task.sensor.features) {
    return nats;
  }
  const LearnedFeatures& learned = *task.sensor.features;
  for (const TouchEvidence& touch : touches) {
    const PressFeatures features = features_of(touch, task.classifier().threshold);
    if (features.values[0] == 0.0) {  // the log of 1 + no element
      continue;
    }
    const double of_any = learned.any.log_density(features);
    for (std::size_t i = 0; i < nats.size(); ++i) {
      if (const auto own = learned.objects.find(task.labels[i]); own != learned.objects.end()) {
        nats[i] += learned.weight * (own->second.log_density(features) - of_any);
      }
    }
  }
  return nats;
}

/// [label] bounds of the log evidence of its hypotheses together; of none_label, where the task has
/// it, those of "none of these".
std::vector<LogInterval> label_log_bounds(const Estimate& estimate, const RecognitionTask& task) {
  const Certificate& certificate = *estimate.certificate;
  std::vector<LogInterval> of_label(task.labels.size(), {log_zero, log_zero});
  for (std::size_t h = 0; h < certificate.log_evidence.size(); ++h) {
    LogInterval& sum = of_label[task.label_of[h]];
    sum.low = log_sum(sum.low, certificate.log_evidence[h].low);
    sum.high = log_sum(sum.high, certificate.log_evidence[h].high);
  }
  if (certificate.none_log_evidence) {
    of_label.back() = *certificate.none_log_evidence;
  }
  return of_label;
}

}  // namespace

ObjectFit fit_of(const Mode& mode, const std::optional<RefinedPose>& refined,
                 std::span<const TouchEvidence> touches, const RecognitionTask& task) {
  const std::size_t in_contact = touches_in_contact(touches);
  if (in_contact == 0) {
    return {};
  }
  const auto object = static_cast<std::size_t>(mode.object);
  const OccupancyGrid& map = task.hypotheses[object].compared();
  const FitScale scale = task.fit_scale_for(touches);
  if (!refined) {
    const std::optional<Fit> fit =
        best_fit_near(touches, mode.T_object_robot, map, task.contact(), object);
    return {.fit = scale.of(fit.value(), in_contact)};
  }
  const std::vector<std::optional<FitSums>> sums =
      fit_sums(touches, refined->T_object_robot, map, task.contact(), task.touch_sd(), object);
  ObjectFit result{.fit = scale.of(combined_fit(sums).value(), in_contact)};
  FitScale of_one = scale;
  if (in_contact > 1) {
    of_one.single_touch.reset();  // the pose is that of all touches
  }
  for (const std::optional<FitSums>& touch : sums) {
    const std::optional<Fit> fit = combined_fit(std::span(&touch, 1));
    result.touches.push_back(fit ? std::optional(of_one.of(*fit, 1).z) : std::nullopt);
  }
  return result;
}

std::optional<Fit> best_fit_near(std::span<const TouchEvidence> touches, const Pose& T_object_robot,
                                 const OccupancyGrid& map, const ContactModel& contact,
                                 std::size_t object) {
  constexpr double step_mm = 0.5;
  constexpr double step_rad = 0.04 * std::numbers::pi;
  std::optional<Fit> best = evidence_fit(touches, T_object_robot, map, contact, {}, object);
  if (!best) {
    return {};
  }
  const glm::dvec2 middle_mm =
      map.origin_mm + 0.5 * map.cell_mm * glm::dvec2(map.nx - 1, map.ny - 1);
  Pose best_pose = T_object_robot;
  for (const double share : {0.5, 0.25, 0.125}) {
    for (const glm::dvec3 move :
         {glm::dvec3(step_mm, 0, 0), glm::dvec3(0, step_mm, 0), glm::dvec3(0, 0, step_rad)}) {
      for (const double sign : {share, -share}) {
        const glm::dvec2 shift_mm = sign * glm::dvec2(move);
        const double turn_rad = sign * move.z;
        const Pose moved =
            Pose{shift_mm + middle_mm - rotate(turn_rad, middle_mm), turn_rad} * best_pose;
        const std::optional<Fit> fit = evidence_fit(touches, moved, map, contact, {}, object);
        if (fit->z > best->z) {
          best = fit;
          best_pose = moved;
        }
      }
    }
  }
  return best;
}

double stranger_density(const Fit& fit, std::size_t touches, const FitScale& scale) {
  if (touches == 1 && scale.stranger_single_touch) {
    const auto [mean, sd] = *scale.stranger_single_touch;
    return density(fit, mean, std::sqrt(std::max(sd * sd - 1.0, 0.0)));
  }
  const double each_sd = scale.stranger_sd.value_or(usual_stranger_sd);
  return density(fit, 0.0, each_sd * (static_cast<double>(touches) - 1.0));
}

double misfit_nats(const Fit& fit, std::size_t touches, const FitScale& scale) {
  // The scale is of the touches that were learned from. Of 160 single presses by a sensor whose
  // elements have other gains, one in ten has z below -3.9 and one in twenty below -5.4: the lower
  // half of a standard deviation of 3.
  constexpr double single_touch_sd = 3.0;
  const bool single_touch = touches == 1 && scale.stranger_single_touch;
  const double learned =
      density(fit, 0.0, single_touch ? std::sqrt(single_touch_sd * single_touch_sd - 1.0) : 0.0);
  return std::log(stranger_density(fit, touches, scale) / learned);
}

double log_sum(double a, double b) {
  const double largest = std::max(a, b);
  return largest == log_zero ? log_zero : largest + std::log1p(std::exp(std::min(a, b) - largest));
}

std::vector<double> sums_by_label(const Estimate& estimate, const RecognitionTask& task) {
  std::vector<double> sums(task.labels.size());
  for (std::size_t i = 0; i < estimate.identity.size(); ++i) {
    sums[task.label_of[i]] += estimate.identity[i];
  }
  if (task.labels.back() == none_label) {
    sums.back() = estimate.none;
  }
  return sums;
}

std::vector<double> label_log_evidence(const Estimate& estimate, const RecognitionTask& task) {
  std::vector<double> logs(task.labels.size(), log_zero);
  for (std::size_t i = 0; i < estimate.log_evidence.size(); ++i) {
    double& sum = logs[task.label_of[i]];
    sum = log_sum(sum, estimate.log_evidence[i]);
  }
  return logs;
}

Tempering tempering_of(std::span<const TouchEvidence> touches, const RecognitionTask& task,
                       const std::optional<Fit>& fit) {
  Tempering tempering{task.temperature_after(touches), feature_nats(touches, task)};
  const FitScale scale = task.fit_scale();
  const bool on_scale = scale.shared_sd > 0.0;
  if (fit && on_scale && task.labels.back() == none_label) {
    tempering.features.back() += misfit_nats(*fit, touches_in_contact(touches), scale);
  }
  return tempering;
}

std::vector<double> label_probabilities(const Estimate& estimate, const Tempering& tempering,
                                        const RecognitionTask& task) {
  const bool plain = std::ranges::all_of(tempering.features, [](double f) { return f == 0.0; });
  if (tempering.temperature == 1.0 && plain) {
    return sums_by_label(estimate, task);
  }
  std::vector<double> logs = label_log_evidence(estimate, task);
  if (estimate.none_log_evidence) {
    logs.back() = *estimate.none_log_evidence;
  }
  for (std::size_t i = 0; i < logs.size(); ++i) {
    logs[i] = tempering.tempered(logs[i], i);
  }
  return normalised(std::move(logs));
}

std::vector<ProbabilityInterval> label_bounds(const Estimate& estimate,
                                              std::span<const double> identity,
                                              const Tempering& tempering,
                                              const RecognitionTask& task) {
  std::vector<LogInterval> of_label = label_log_bounds(estimate, task);
  for (std::size_t i = 0; i < of_label.size(); ++i) {
    of_label[i] = {tempering.tempered(of_label[i].low, i), tempering.tempered(of_label[i].high, i)};
  }
  std::vector<ProbabilityInterval> bounds;
  for (std::size_t i = 0; i < of_label.size(); ++i) {
    LogInterval others{log_zero, log_zero};
    for (std::size_t j = 0; j < of_label.size(); ++j) {
      if (j != i) {
        others.low = log_sum(others.low, of_label[j].low);
        others.high = log_sum(others.high, of_label[j].high);
      }
    }
    bounds.push_back({share(of_label[i].low, others.high), share(of_label[i].high, others.low)});
  }
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    // The probability itself is rounded, too.
    bounds[i] = {std::min(bounds[i].low, identity[i]), std::max(bounds[i].high, identity[i])};
  }
  return bounds;
}

}  // namespace palpate
