#include "recognition/label_bounds.hpp"

#include <algorithm>
#include <cmath>

#include "recognition/label_probability.hpp"

namespace palpate {

namespace {

/// exp(a) / (exp(a) + exp(b)); 0 where both are 0
double share(double a, double b) { return a == log_zero ? 0.0 : 1.0 / (1.0 + std::exp(b - a)); }

}  // namespace

std::vector<ProbabilityInterval> label_bounds(const Estimate& estimate,
                                              std::span<const double> identity,
                                              const Tempering& tempering,
                                              const RecognitionTask& task,
                                              std::optional<double> known) {
  const bool learned_none = known && task.labels.back() == none_label;
  const double times = learned_none ? *known : 1.0;
  const Certificate& certificate = *estimate.certificate;
  const std::vector<LogInterval>& evidence = certificate.log_evidence;
  std::vector<LogInterval> of_label(task.labels.size(), {log_zero, log_zero});
  for (std::size_t h = 0; h < evidence.size(); ++h) {
    LogInterval& sum = of_label[task.label_of[h]];
    sum.low = log_sum(sum.low, evidence[h].low);
    sum.high = log_sum(sum.high, evidence[h].high);
  }
  if (certificate.none_log_evidence && !learned_none) {
    of_label.back() = *certificate.none_log_evidence;
  }
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
    // The probability itself is rounded, too.
    bounds.push_back({std::min(times * share(of_label[i].low, others.high), identity[i]),
                      std::max(times * share(of_label[i].high, others.low), identity[i])});
  }
  if (learned_none) {
    bounds.back() = {identity.back(), identity.back()};
  }
  return bounds;
}

}  // namespace palpate
