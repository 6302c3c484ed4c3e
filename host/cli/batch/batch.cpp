#include <algorithm>
#include <chrono>
#include <cstdint>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <tbb/info.h>
#include <CLI/CLI.hpp>

#include "cli/batch/batch_run.hpp"
#include "cli/commands.hpp"
#include "cli/options.hpp"
#include "cli/progress.hpp"
#include "cli/recognition_flags.hpp"
#include "cli/results_folder.hpp"
#include "cli/text_table.hpp"
#include "io/input_file.hpp"
#include "model/number_text.hpp"
#include "recognition/batch/batch_task.hpp"
#include "recognition/batch/input_reading.hpp"
#include "recognition/request.hpp"

namespace palpate::cli {

namespace {

/// Settles once for all shards what a results folder computes: by the task file that is there or,
/// where there is none, by writing it. Everything that follows from all inputs together, or from
/// the device at hand, is settled here, so that no chunk depends on who computes it.
/// @param asked program, chunk_unknowns, request, files and stamped inputs
/// @param request completed
/// @throws Error (Fault::input) where the folder has results of another task
std::pair<BatchTask, RecognitionJob> settle_batch(const ResultsFolder& folder,
                                                  const BatchTask& asked, const Request& request,
                                                  std::size_t threads) {
  if (!folder.has_task()) {
    BatchTask task = asked;
    with_progress("looking through the recordings",
                  [&](const auto& show) { survey_inputs(task.inputs, request, threads, show); });
    task.inferred = infer(task.inputs, request);
    RecognitionJob job = job_of(task, request);
    make_folder(folder.path());
    if (write_batch_task(folder.task(), task)) {
      std::ranges::for_each(job.task().remarks, tell_on_stderr);
      return {std::move(task), std::move(job)};
    }
    // Another process has settled the task meanwhile.
  }
  BatchTask there = read_batch_task(folder.task());
  for (const std::string& difference :
       {difference_of_tasks(there, asked), difference_of_inputs(there, asked)}) {
    if (!difference.empty()) {
      refuse(folder.path(), "{}; undo that, or give another folder", difference);
    }
  }
  RecognitionJob job = job_of(there, request);
  return {std::move(there), std::move(job)};
}

struct BatchArguments {
  std::vector<std::string> inputs;
  std::string results;
  Request request;
  bool verbose = false;
  std::string shard;
  int chunk = 100;
  int threads = 0;
};

/// Exit status where all is done but some unknowns failed, which other programs rely on.
constexpr int some_failed = 3;

/// One of `count` parts of the chunks of a results folder: chunk k belongs to shard k mod count.
struct Shard {
  std::size_t index = 0;
  std::size_t count = 1;
};

/// The shard of a flag's "I/N"; the whole where it is "".
Shard shard_of(const std::string& flag) {
  constexpr std::int64_t most_shards = 1'000'000;
  if (flag.empty()) {
    return {};
  }
  const std::size_t slash = std::min(flag.find('/'), flag.size() - 1);
  const auto index = whole_number_of(flag.substr(0, slash)).value_or(-1);
  const auto count = whole_number_of(flag.substr(slash + 1)).value_or(-1);
  if (index < 0 || index >= count || count > most_shards) {
    refuse_flag("--shard", flag, "give it as I/N, with I from 0 to N - 1 and N up to {}",
                most_shards);
  }
  return {static_cast<std::size_t>(index), static_cast<std::size_t>(count)};
}

/// The chunks of a shard.
struct Chunks {
  std::vector<bool> wanted;    ///< [chunk] of the shard and not there yet
  std::size_t unknowns = 0;    ///< of the shard
  std::size_t to_be_done = 0;  ///< unknowns of wanted chunks
  BatchCounts finished;        ///< unknowns of its other chunks
};

Chunks chunks_of(const ResultsFolder& folder, const BatchTask& task, const Shard& shard) {
  Chunks chunks{std::vector<bool>(task.chunks()), 0, 0, {}};
  const std::vector<std::size_t> finished = folder.finished_chunks();
  const std::size_t all = task.unknowns();
  for (std::size_t chunk = shard.index; chunk < chunks.wanted.size(); chunk += shard.count) {
    const std::size_t unknowns = std::min(task.chunk_unknowns, all - chunk * task.chunk_unknowns);
    chunks.unknowns += unknowns;
    chunks.wanted[chunk] = !std::ranges::binary_search(finished, chunk);
    if (chunks.wanted[chunk]) {
      chunks.to_be_done += unknowns;
      continue;
    }
    chunks.finished.done += unknowns;
    chunks.finished.failed += read_chunk(folder.chunk(chunk), unknowns).failed;
  }
  return chunks;
}

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

std::string batch_summary(const BatchArguments& options, const Shard& shard, const Chunks& chunks,
                          const BatchCounts& now, double seconds) {
  const std::size_t failed = chunks.finished.failed + now.failed;
  std::string text =
      fmt::format("{}: {}", options.results, count_of(chunks.unknowns, "unknown", "unknowns"));
  if (shard.count > 1) {
    text += fmt::format(" of shard {}/{}", shard.index, shard.count);
  }
  text += also(chunks.finished.done, "done before");
  if (now.done > 0) {
    text += fmt::format(", {} now in {:.1f} s ({:.0f} per second)", now.done, seconds,
                        static_cast<double>(now.done) / seconds);
  }
  return text + fmt::format("; {} failed\n", failed);
}

void batch(const BatchArguments& options) {
  refuse_budget(options.request);
  if (options.chunk < 1) {
    refuse_flag("--chunk", options.chunk, "give at least 1");
  }
  const Shard shard = shard_of(options.shard);
  require_selection(options.request);
  const Request request = complete(options.request);
  BatchTask asked{.program = PALPATE_VERSION,
                  .chunk_unknowns = static_cast<std::size_t>(options.chunk),
                  .request = options.request,
                  .inputs = list_inputs(options.inputs)};
  hash_files(asked, request);
  const ResultsFolder folder(options.results);
  folder.require_own();
  // By default the cores that this process may use: a job's or those of taskset.
  const auto threads = static_cast<std::size_t>(
      options.threads > 0 ? options.threads : tbb::info::default_concurrency());
  const auto [task, job] = settle_batch(folder, asked, request, threads);
  const Chunks chunks = chunks_of(folder, task, shard);
  const auto begin = std::chrono::steady_clock::now();
  BatchCounts now;
  if (chunks.to_be_done > 0) {
    folder.make();
    job.device();  // opens it before the line of progress is there
    Progress progress("recognising");
    const auto recognising = std::chrono::steady_clock::now();
    const BatchRun run{.folder = folder,
                       .task = task,
                       .job = job,
                       .wanted = chunks.wanted,
                       .to_be_done = chunks.to_be_done,
                       .threads = threads,
                       .verbose = options.verbose};
    now = run_batch(run, [&](const BatchCounts& counts) {
      const auto done = static_cast<double>(counts.done);
      progress.show(
          done / static_cast<double>(run.to_be_done),
          fmt::format(", {:.0f} per second{}", done / seconds_since(recognising),
                      counts.failed > 0 ? fmt::format(", {} failed", counts.failed) : ""));
    });
  }
  fmt::print("{}", batch_summary(options, shard, chunks, now, seconds_since(begin)));
  if (chunks.finished.failed + now.failed > 0) {
    throw CLI::RuntimeError(some_failed);
  }
}

}  // namespace

void add_batch(CLI::App& app) {
  const auto [command, options] = add_command<BatchArguments>(
      app, "batch",
      "Recognise very many unknowns into a folder of results. Killed at any moment, the same "
      "command goes on where it was, and its results are the same, byte for byte. A recording that "
      "cannot be recognised becomes a record with its error, and the exit status is 3. Several "
      "processes or machines share the work by --shard; palpate merge joins the results",
      batch);
  add_required(*command, "INPUT", options->inputs,
               "Manifests (*.csv with the columns path, frames and label, of which path alone "
               "must be there), folders of recordings, recordings, or quoted patterns of them");
  add_required(*command, "-o,--output", options->results,
               "Folder of results; made where it is missing, else completed");
  add_recognition_flags(*command, options->request, options->verbose);
  command->get_option("--budget-ms")->group("");  // read still, to be refused with its reason
  add_selection_flags(*command, options->request);
  command->add_option("--shard", options->shard,
                      "Recognise only part I of N, from 0 to N - 1, as I/N, such as "
                      "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT [default: all]");
  command
      ->add_option("--chunk", options->chunk,
                   "Unknowns of a chunk, which is what a killed process loses [default: 100]")
      ->check(require_whole_number);
  command
      ->add_option("--threads", options->threads,
                   "Host threads; results do not depend on them [default: the cores at hand]")
      ->check(require_whole_number);
}

}  // namespace palpate::cli
