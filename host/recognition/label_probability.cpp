#include "recognition/label_probability.hpp"

#include <algorithm>
#include <cmath>

#include "recognition/object_fit.hpp"

namespace palpate {

namespace {

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
  const double largest = *std::max_element(logs.begin(), logs.end());
  double total = 0.0;
  for (double& p : logs) {
    p = std::exp(p - largest);
    total += p;
  }
  for (double& p : logs) {
    p /= total;
  }
  return logs;
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
