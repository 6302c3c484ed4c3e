#include "trial_errors.hpp"

#include <algorithm>
#include <vector>

#include "measurement.hpp"

namespace palpate::bench {

namespace {

double standard_error_or_0(std::span<const double> values) {
  return values.size() > 1 ? standard_error(values) : 0.0;
}

}  // namespace

TrialErrors errors_of(const RecognitionStep& last) {
  return {.mode_mm = last.error_mm, .refined_mm = last.refined_error_mm};
}

std::optional<ErrorsOverTrials> errors_over(std::span<const TrialErrors> trials, PoseKind kind) {
  constexpr std::size_t least_for_p95 = 20;
  std::vector<double> errors_mm;
  for (const TrialErrors& trial : trials) {
    if (trial.of(kind)) {
      errors_mm.push_back(*trial.of(kind));
    }
  }
  if (errors_mm.empty()) {
    return {};
  }
  ErrorsOverTrials errors{.trials = static_cast<int>(errors_mm.size()),
                          .mean_mm = mean(errors_mm),
                          .standard_error_mm = standard_error_or_0(errors_mm),
                          .median_mm = median(errors_mm)};
  if (errors_mm.size() >= least_for_p95) {
    errors.p95_mm = quantile(errors_mm, 0.95);
  }
  return errors;
}

bool PairedErrors::gain() const {
  const double less_mm = first_mm - second_mm;
  return trials > 1 && less_mm > least_gain * first_mm && less_mm > 2.0 * standard_error_mm;
}

PairedErrors paired_errors(std::span<const TrialErrors> first, std::span<const TrialErrors> second,
                           PoseKind kind) {
  std::vector<double> first_mm;
  std::vector<double> second_mm;
  std::vector<double> less_mm;
  for (std::size_t i = 0; i < std::min(first.size(), second.size()); ++i) {
    const std::optional<double>& a = first[i].of(kind);
    const std::optional<double>& b = second[i].of(kind);
    if (a && b) {
      first_mm.push_back(*a);
      second_mm.push_back(*b);
      less_mm.push_back(*a - *b);
    }
  }
  if (less_mm.empty()) {
    return {};
  }
  return {.trials = static_cast<int>(less_mm.size()),
          .first_mm = mean(first_mm),
          .second_mm = mean(second_mm),
          .standard_error_mm = standard_error_or_0(less_mm)};
}

}  // namespace palpate::bench
