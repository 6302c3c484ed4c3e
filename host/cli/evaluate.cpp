#include "cli/commands.hpp"

#include <unistd.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "cli/command_files.hpp"
#include "cli/evaluate_output.hpp"
#include "cli/options.hpp"
#include "cli/recognition_flags.hpp"
#include "cli/results_folder.hpp"
#include "recognition/batch/batch_task.hpp"
#include "recognition/judged_results.hpp"
#include "recognition/record_json.hpp"

namespace palpate::cli {

namespace {

struct EvaluateArguments {
  std::vector<std::string> results;
  std::string json;
};

/// Throws Error where an output cannot be written, before any file is.
void check_outputs(const EvaluateArguments& options,
                   const std::vector<std::filesystem::path>& read) {
  CommandFiles files;
  for (const std::filesystem::path& file : read) {
    files.reads("RESULTS", file);
  }
  for (const std::string& results : options.results) {
    if (ResultsFolder(results).has_task()) {
      files.reads("RESULTS", ResultsFolder(results).task());
    }
  }
  files.writes("--json", options.json, CommandFiles::Dash::stream);
  files.prepare();
}

/// Says how much a folder of palpate batch still lacks.
void tell_missing(const std::string& results) {
  if (!ResultsFolder(results).has_task()) {
    return;
  }
  const ResultsFolder folder(results);
  const BatchTask task = read_batch_task(folder.task());
  const std::size_t chunks = task.chunks();
  const std::size_t missing = chunks - folder.finished_chunks(chunks).size();
  if (missing > 0) {
    tell_on_stderr(fmt::format("{}: {} of {} chunks are missing; palpate batch completes them",
                               results, missing, chunks));
  }
}

void evaluate_results(const EvaluateArguments& options) {
  const std::vector<std::filesystem::path> files = result_files(options.results);
  check_outputs(options, files);
  const JudgedResults results = read_results(files);
  const Evaluation evaluation = evaluate(results, options.results.front());
  for (const std::string& folder : options.results) {
    tell_missing(folder);
  }
  if (const std::string failed = failed_words(results); !failed.empty()) {
    tell_on_stderr(failed);
  }
  const std::string json = text_of(to_json(evaluation, results), 2);
  give_result(options.json, json, evaluation_text(evaluation, results.without_truth));
}

}  // namespace

void add_evaluate(CLI::App& app) {
  auto* command = app.add_subcommand(
      "evaluate",
      "Compare what palpate recognize --json or palpate batch wrote with the truth: accuracy and "
      "recall of every "
      "class with 95 % intervals, what each class was taken for, log-loss, how far confidence is "
      "from accuracy, and median pose errors. A class that no map has is an unknown class, whose "
      "right answer is \"(none)\"; the area under the curve says how well unknown classes are told "
      "from known ones");
  const auto options = std::make_shared<EvaluateArguments>();
  command
      ->add_option("RESULTS", options->results,
                   "JSON files of palpate recognize, files with one such record a line, folders of "
                   "palpate batch, or folders of *.json. Records without a true label are left out")
      ->required();
  command->add_option("--json", options->json, "Write all numbers as JSON; - is standard output");
  command->callback([options] { evaluate_results(*options); });
}

}  // namespace palpate::cli
