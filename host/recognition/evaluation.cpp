#include "recognition/evaluation.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <utility>

#include "palpate/occupancy_grid.hpp"

namespace palpate {

Interval wilson_interval(double successes, std::size_t trials) {
  constexpr double z = 1.959964;  // the standard normal's 97.5th percentile
  const auto n = static_cast<double>(trials);
  const double p = successes / n;
  const double centre = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
  const double half_width =
      z / (1.0 + z * z / n) * std::sqrt(p * (1.0 - p) / n + z * z / (4.0 * n * n));
  // Rounding must not leave the ends at 0 and 1 outside.
  return {successes == 0.0 ? 0.0 : centre - half_width, successes == n ? 1.0 : centre + half_width};
}

double told_apart(std::span<const double> lower, std::span<const double> higher) {
  std::vector<double> sorted(higher.begin(), higher.end());
  std::sort(sorted.begin(), sorted.end());
  double apart = 0.0;
  for (const double low : lower) {
    const auto [first, last] = std::equal_range(sorted.begin(), sorted.end(), low);
    apart += static_cast<double>(sorted.end() - last) + 0.5 * static_cast<double>(last - first);
  }
  return apart / (static_cast<double>(lower.size()) * static_cast<double>(higher.size()));
}

double told_apart_error(double area, std::size_t lower, std::size_t higher) {
  const auto n_lower = static_cast<double>(lower);
  const auto n_higher = static_cast<double>(higher);
  // The probability that two values of one kind are both on the right side of one of the other.
  const double two_higher = area / (2.0 - area);
  const double two_lower = 2.0 * area * area / (1.0 + area);
  const double square = area * area;
  const double variance = area * (1.0 - area) + (n_higher - 1.0) * (two_higher - square) +
                          (n_lower - 1.0) * (two_lower - square);
  return std::sqrt(std::max(variance, 0.0) / (n_lower * n_higher));
}

namespace {

const std::string none_answer(none_label);

/// @param known whether classes are known that count; none: all classes
/// @returns none where no record counts
std::optional<Scores> scores_of(std::span<const JudgedRecord> records, std::optional<bool> known) {
  Scores scores;
  const auto bins = static_cast<double>(scores.bins.size());
  for (std::size_t k = 0; k < scores.bins.size(); ++k) {
    scores.bins[k].lower = static_cast<double>(k) / bins;
    scores.bins[k].upper = static_cast<double>(k + 1) / bins;
  }
  for (const JudgedRecord& record : records) {
    if (known && record.of_known_class() != *known) {
      continue;
    }
    const auto bin = static_cast<std::size_t>(std::max(bins * record.confidence(), 0.0));
    ReliabilityBin& at = scores.bins[std::min(bin, scores.bins.size() - 1)];
    ++at.records;
    at.right += record.right() ? 1 : 0;
    at.mean_confidence += record.confidence();
    ++scores.records;
    scores.right += record.right() ? 1 : 0;
    scores.log_loss -= std::log(std::max(record.answer_probability(), least_answer_probability));
  }
  if (scores.records == 0) {
    return {};
  }
  const auto n = static_cast<double>(scores.records);
  scores.log_loss /= n;
  for (ReliabilityBin& bin : scores.bins) {
    if (bin.records > 0) {
      const auto in_bin = static_cast<double>(bin.records);
      bin.mean_confidence /= in_bin;
      scores.calibration_error += in_bin / n * std::abs(bin.accuracy() - bin.mean_confidence);
    }
  }
  return scores;
}

std::vector<std::string> answers_of(std::span<const JudgedRecord> records) {
  std::set<std::string> labels;
  for (const JudgedRecord& record : records) {
    labels.insert(record.best);
    if (record.of_known_class()) {
      labels.insert(record.truth);
    }
    if (record.identity.contains(none_answer)) {
      labels.insert(none_answer);
    }
  }
  const bool none = labels.erase(none_answer) > 0;
  std::vector<std::string> answers(labels.begin(), labels.end());
  if (none) {
    answers.push_back(none_answer);
  }
  return answers;
}

std::vector<ClassScores> classes_of(std::span<const JudgedRecord> records,
                                    const std::vector<std::string>& answers) {
  std::map<std::string, std::size_t> place;
  for (std::size_t k = 0; k < answers.size(); ++k) {
    place[answers[k]] = k;
  }
  std::map<std::pair<bool, std::string>, ClassScores> classes;  // known ones first
  for (const JudgedRecord& record : records) {
    const bool known = record.of_known_class();
    ClassScores& of = classes[{!known, record.truth}];
    of.label = record.truth;
    of.known = known;
    of.taken.resize(answers.size());
    ++of.records;
    of.right += record.right() ? 1 : 0;
    ++of.taken[place.at(record.best)];
  }
  std::vector<ClassScores> result;
  for (auto& [key, scores] : classes) {
    result.push_back(std::move(scores));
  }
  return result;
}

/// @param score_of a record, larger for known classes; none where it has none
template <typename Score>
std::optional<KnownAgainstUnknown> compare_by(const char* name, const Score& score_of,
                                              std::span<const JudgedRecord> records) {
  std::vector<double> of_known;
  std::vector<double> of_unknown;
  for (const JudgedRecord& record : records) {
    if (const std::optional<double> value = score_of(record)) {
      (record.of_known_class() ? of_known : of_unknown).push_back(*value);
    }
  }
  if (of_known.empty() || of_unknown.empty()) {
    return {};
  }
  const double area = told_apart(of_unknown, of_known);
  return KnownAgainstUnknown{
      .score = name,
      .known = of_known.size(),
      .unknown = of_unknown.size(),
      .area = area,
      .standard_error = told_apart_error(area, of_unknown.size(), of_known.size())};
}

std::optional<KnownAgainstUnknown> known_against_unknown(std::span<const JudgedRecord> records) {
  const auto known = [](const JudgedRecord& record) {
    return record.none ? std::optional(1.0 - *record.none) : std::nullopt;
  };
  const auto by_none = compare_by("1 - none", known, records);
  const auto by_fit = compare_by("fit.z", std::mem_fn(&JudgedRecord::fit_z), records);
  const bool by_more = by_fit && (!by_none || by_fit->records() > by_none->records());
  return by_more ? by_fit : by_none;
}

std::optional<Median> median_of(std::span<const JudgedRecord> records,
                                std::optional<double> JudgedRecord::*error) {
  std::vector<double> values;
  for (const JudgedRecord& record : records) {
    if (record.*error) {
      values.push_back(*(record.*error));
    }
  }
  if (values.empty()) {
    return {};
  }
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  const double middle =
      values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
  return Median{.count = values.size(), .value = middle};
}

}  // namespace

bool JudgedRecord::of_known_class() const {
  return truth != none_answer && identity.contains(truth);
}

std::string JudgedRecord::answer() const { return of_known_class() ? truth : none_answer; }

double JudgedRecord::answer_probability() const {
  const auto found = identity.find(answer());
  return found == identity.end() ? 0.0 : found->second;
}

Evaluation evaluate(std::span<const JudgedRecord> records) {
  Evaluation evaluation;
  evaluation.all = scores_of(records, {}).value();
  evaluation.unknown = scores_of(records, false);
  if (evaluation.unknown) {
    evaluation.known = scores_of(records, true);
    evaluation.known_against_unknown = known_against_unknown(records);
  }
  evaluation.answers = answers_of(records);
  evaluation.classes = classes_of(records, evaluation.answers);
  evaluation.error_mm = median_of(records, &JudgedRecord::error_mm);
  evaluation.refined_error_mm = median_of(records, &JudgedRecord::refined_error_mm);
  return evaluation;
}

}  // namespace palpate
