#include "cli/commands.hpp"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "cli/command_files.hpp"
#include "cli/options.hpp"
#include "cli/results_folder.hpp"
#include "cli/text_table.hpp"
#include "palpate/occupancy_grid.hpp"
#include "recognition/batch/batch_task.hpp"
#include "recognition/judged_results.hpp"
#include "recognition/record_json.hpp"

namespace palpate::cli {

namespace {

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

/// The wrong answers, the most frequent first: "3 A, 1 (none)".
std::string taken_for(const ClassScores& scores, const std::vector<std::string>& answers) {
  const std::string_view right = scores.known ? std::string_view(scores.label) : none_label;
  std::multimap<std::size_t, std::string, std::greater<>> wrong;  // [how often]
  for (std::size_t k = 0; k < answers.size(); ++k) {
    if (scores.taken[k] > 0 && answers[k] != right) {
      wrong.emplace(scores.taken[k], answers[k]);
    }
  }
  std::string text;
  for (const auto& [count, answer] : wrong) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, answer);
  }
  return text;
}

std::string class_table(const Evaluation& evaluation) {
  TextTable table({{"class"},
                   {"records", true},
                   {"right", true},
                   {"recall", true},
                   {"95 % interval", true},
                   {"taken for"}});
  for (const ClassScores& scores : evaluation.classes) {
    table.add({scores.label + (scores.known ? "" : " (unknown)"), fmt::format("{}", scores.records),
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
        "area under the curve of known against unknown classes by {}: {:.3f} +- {:.3f} ({} known, "
        "{} unknown)\n",
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

/// The scores, the reliability bins that have records, a line for each class with what it was taken
/// for, unknown classes and pose errors.
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

struct EvaluateArguments {
  std::vector<std::string> results;
  std::string json;
};

/// Says how much a folder of palpate batch still lacks.
void tell_missing(const ResultsFolder& folder) {
  const BatchTask task = read_batch_task(folder.task());
  const std::size_t chunks = task.chunks();
  const std::size_t missing = chunks - folder.finished_chunks(chunks).size();
  if (missing > 0) {
    tell_on_stderr(fmt::format("{}: {} of {} chunks are missing; palpate batch completes them",
                               folder.path().string(), missing, chunks));
  }
}

void evaluate_results(const EvaluateArguments& options) {
  const std::vector<std::filesystem::path> files = result_files(options.results);
  std::vector<ResultsFolder> folders(options.results.begin(), options.results.end());
  std::erase_if(folders, [](const ResultsFolder& folder) { return !folder.has_task(); });
  CommandFiles all;
  for (const std::filesystem::path& file : files) {
    all.reads("RESULTS", file);
  }
  for (const ResultsFolder& folder : folders) {
    all.reads("RESULTS", folder.task());
  }
  all.writes("--json", options.json, CommandFiles::Dash::stream).prepare();
  const JudgedResults results = read_results(files);
  const Evaluation evaluation = evaluate(results, options.results.front());
  std::ranges::for_each(folders, tell_missing);
  if (results.failed > 0) {
    tell_on_stderr(count_of(results.failed, "unknown", "unknowns") +
                   " could not be recognised, and left out; their records say why");
  }
  const std::string json = text_of(to_json(evaluation, results), 2);
  give_result(options.json, json, evaluation_text(evaluation, results.without_truth));
}

}  // namespace

void add_evaluate(CLI::App& app) {
  const auto [command, options] = add_command<EvaluateArguments>(
      app, "evaluate",
      "Compare what palpate recognize --json or palpate batch wrote with the truth: accuracy and "
      "recall of every class with 95 % intervals, what each class was taken for, log-loss, how far "
      "confidence is from accuracy, and median pose errors. A class that no map has is an unknown "
      "class, whose right answer is \"(none)\"; the area under the curve says how well unknown "
      "classes are told from known ones",
      evaluate_results);
  add_required(*command, "RESULTS", options->results,
               "JSON files of palpate recognize, files with one such record a line, folders of "
               "palpate batch, or folders of *.json. Records without a true label are left out");
  command->add_option("--json", options->json, "Write all numbers as JSON; - is standard output");
}

}  // namespace palpate::cli
