#include "trial_errors.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include "measurement.hpp"

namespace palpate::bench {

namespace {

double standard_error_or_0(std::span<const double> values) {
  return values.size() > 1 ? standard_error(values) : 0.0;
}

}  // namespace

void PoseErrors::add(const RecognitionStep& last) {
  mode_mm.push_back(last.error_mm);
  refined_mm.push_back(last.refined_error_mm);
}

std::vector<double> present(const TrialErrors& errors_mm) {
  std::vector<double> present_mm;
  for (const std::optional<double>& error_mm : errors_mm) {
    if (error_mm) {
      present_mm.push_back(*error_mm);
    }
  }
  return present_mm;
}

std::optional<ErrorsOverTrials> errors_over(const TrialErrors& errors_mm) {
  const std::vector<double> present_mm = present(errors_mm);
  if (present_mm.empty()) {
    return {};
  }
  return ErrorsOverTrials{.trials = static_cast<int>(present_mm.size()),
                          .mean_mm = mean(present_mm),
                          .standard_error_mm = standard_error_or_0(present_mm),
                          .median_mm = median(present_mm),
                          .p95_mm = quantile(present_mm, 0.95)};
}

bool PairedErrors::gain() const {
  const double less_mm = first_mm - second_mm;
  return trials > 1 && less_mm > least_gain * first_mm && less_mm > 2.0 * standard_error_mm;
}

PairedErrors paired_errors(const TrialErrors& first_mm, const TrialErrors& second_mm) {
  std::vector<double> a_mm;
  std::vector<double> b_mm;
  std::vector<double> less_mm;
  for (std::size_t i = 0; i < std::min(first_mm.size(), second_mm.size()); ++i) {
    if (first_mm[i] && second_mm[i]) {
      a_mm.push_back(*first_mm[i]);
      b_mm.push_back(*second_mm[i]);
      less_mm.push_back(*first_mm[i] - *second_mm[i]);
    }
  }
  if (less_mm.empty()) {
    return {};
  }
  return {.trials = static_cast<int>(less_mm.size()),
          .first_mm = mean(a_mm),
          .second_mm = mean(b_mm),
          .standard_error_mm = standard_error_or_0(less_mm)};
}

std::optional<std::size_t> knee_of(std::span<const TrialErrors> runs) {
  for (std::size_t i = 0; i + 1 < runs.size(); ++i) {
    const auto no_gain = [&](const TrialErrors& finer) {
      const PairedErrors paired = paired_errors(runs[i], finer);
      return paired.trials > 0 && !paired.gain();
    };
    const bool all_located = std::ranges::all_of(
        runs[i], [](const std::optional<double>& error_mm) { return error_mm.has_value(); });
    if (all_located && std::ranges::all_of(runs.subspan(i + 1), no_gain)) {
      return i;
    }
  }
  return {};
}

std::vector<std::size_t> pareto_front(std::span<const CostAndError> entries) {
  std::vector<std::size_t> order(entries.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(
      order, {}, [&](std::size_t i) { return std::pair(entries[i].cost, entries[i].error); });
  std::vector<std::size_t> front;
  double least = std::numeric_limits<double>::infinity();
  for (const std::size_t i : order) {
    if (entries[i].error < least) {
      least = entries[i].error;
      front.push_back(i);
    }
  }
  return front;
}

}  // namespace palpate::bench
