#include "cli/evaluate_output.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "palpate/occupancy_grid.hpp"

namespace palpate::cli {

namespace {

std::string range_words(const Interval& interval) {
  return fmt::format("{:.1f} to {:.1f} %", 100.0 * interval.low, 100.0 * interval.high);
}

std::string scores_table(const Evaluation& evaluation) {
  // A column without content is left out.
  TextTable table({{""}, {"all", true}, {"known classes", true}});
  const auto add = [&](const char* name, auto text_of) {
    table.add({name, text_of(evaluation.all),
               evaluation.known ? std::string(text_of(*evaluation.known)) : ""});
  };
  add("records", [](const Scores& s) { return fmt::format("{}", s.records); });
  add("right", [](const Scores& s) { return fmt::format("{}", s.right); });
  add_score_rows(table, {&evaluation.all, evaluation.known ? &*evaluation.known : nullptr});
  return table.text();
}

std::string reliability_table(const Scores& scores) {
  TextTable table({{"confidence"},
                   {"records", true},
                   {"mean", true},
                   {"accuracy", true},
                   {"95 % interval", true}});
  for (const ReliabilityBin& bin : scores.bins) {
    if (bin.records > 0) {
      table.add({fmt::format("{:.1f} to {:.1f}", bin.lower, bin.upper),
                 fmt::format("{}", bin.records), percent(bin.mean_confidence),
                 percent(bin.accuracy()), range_words(bin.interval())});
    }
  }
  return table.text();
}

std::string class_name(const ClassScores& scores) {
  return scores.label + (scores.known ? "" : " (unknown)");
}

/// The wrong answers, the most frequent first.
std::string taken_for(const ClassScores& scores, const std::vector<std::string>& answers) {
  const std::string_view right = scores.known ? std::string_view(scores.label) : none_label;
  std::vector<std::pair<std::size_t, std::string>> wrong;
  for (std::size_t k = 0; k < answers.size(); ++k) {
    if (scores.taken[k] > 0 && answers[k] != right) {
      wrong.emplace_back(scores.taken[k], answers[k]);
    }
  }
  std::ranges::stable_sort(wrong, std::ranges::greater{},
                           [](const auto& one) { return one.first; });
  std::string list;
  for (const auto& [count, answer] : wrong) {
    list += fmt::format("{}{} {}", list.empty() ? "" : ", ", count, answer);
  }
  return list;
}

std::string class_table(const Evaluation& evaluation) {
  TextTable table({{"class"},
                   {"records", true},
                   {"right", true},
                   {"recall", true},
                   {"95 % interval", true},
                   {"taken for"}});
  for (const ClassScores& scores : evaluation.classes) {
    table.add({class_name(scores), fmt::format("{}", scores.records),
               fmt::format("{}", scores.right), percent(scores.accuracy()),
               range_words(scores.interval()), taken_for(scores, evaluation.answers)});
  }
  return table.text();
}

std::string unknown_words(const Evaluation& evaluation) {
  if (!evaluation.unknown) {
    return "";
  }
  const Scores& unknown = *evaluation.unknown;
  std::string text = fmt::format(
      "unknown classes: {} of {} called \"(none)\" ({}, 95 % interval {})\n", unknown.right,
      unknown.records, percent(unknown.accuracy()), range_words(unknown.interval()));
  if (const auto& against = evaluation.known_against_unknown) {
    text += fmt::format(
        "area under the curve of known against unknown classes by {}: {:.3f} +- {:.3f} "
        "({} known, {} unknown)\n",
        against->score, against->area, against->standard_error, against->known, against->unknown);
  } else if (evaluation.known) {
    text += "no area under the curve: records of both kinds need none or fit.z\n";
  }
  return text;
}

std::string error_words(const Evaluation& evaluation) {
  std::string text;
  const auto add = [&](const char* of, const std::optional<Median>& median) {
    if (median) {
      text += fmt::format("{}{} {:.2f} mm ({})", text.empty() ? "median error of " : ", of ", of,
                          median->value, count_of(median->count, "record", "records"));
    }
  };
  add("refined poses", evaluation.refined_error_mm);
  add("modes", evaluation.error_mm);
  return text.empty() ? "" : text + "\n";
}

}  // namespace

void add_score_rows(TextTable& table, const std::vector<const Scores*>& columns) {
  const auto add = [&](const char* name, auto text_of) {
    std::vector<std::string> cells{name};
    for (const Scores* scores : columns) {
      cells.push_back(scores == nullptr ? std::string() : text_of(*scores));
    }
    table.add(cells);
  };
  add("accuracy", [](const Scores& s) { return percent(s.accuracy()); });
  add("95 % interval", [](const Scores& s) { return range_words(s.interval()); });
  add("log-loss, nats", [](const Scores& s) { return fmt::format("{:.3f}", s.log_loss); });
  add("calibration error",
      [](const Scores& s) { return fmt::format("{:.3f}", s.calibration_error); });
}

std::string evaluation_text(const Evaluation& evaluation, std::size_t without_truth) {
  std::string text = scores_table(evaluation);
  if (without_truth > 0) {
    text += fmt::format("{} without a true label left out\n",
                        count_of(without_truth, "record", "records"));
  }
  text += "\n" + reliability_table(evaluation.all);
  text += "\n" + class_table(evaluation);
  text += unknown_words(evaluation) + error_words(evaluation);
  return text;
}

}  // namespace palpate::cli
