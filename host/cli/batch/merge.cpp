#include <algorithm>
#include <optional>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "cli/command_files.hpp"
#include "cli/commands.hpp"
#include "cli/options.hpp"
#include "cli/results_folder.hpp"
#include "io/atomic_file.hpp"
#include "io/input_file.hpp"
#include "recognition/batch/batch_task.hpp"

namespace palpate::cli {

namespace {

struct MergeArguments {
  std::string results;
  std::string output = "-";
  bool partial = false;
};

/// The unknowns of the chunks that are not there: "100 to 199, 300 to 349", shortened.
std::string missing_unknowns(const std::vector<std::size_t>& there, const BatchTask& task) {
  constexpr std::size_t limit = 3;
  std::string text;
  std::size_t ranges = 0;
  std::size_t begin = 0;
  for (std::size_t i = 0; i <= there.size(); ++i) {
    const std::size_t end = i < there.size() ? there[i] : task.chunks();
    if (begin < end) {
      if (ranges++ == limit) {
        return text + ", and more";
      }
      text += fmt::format("{}{} to {}", text.empty() ? "" : ", ", begin * task.chunk_unknowns,
                          std::min(end * task.chunk_unknowns, task.unknowns()) - 1);
    }
    begin = end + 1;
  }
  return text;
}

/// Refuses to write over what is merged, or beside the chunks, where evaluate would read it too.
void check_output(const MergeArguments& options, const ResultsFolder& folder,
                  const std::vector<std::size_t>& there) {
  CommandFiles files;
  files.reads("RESULTS", folder.task());
  for (const std::size_t chunk : there) {
    files.reads("RESULTS", folder.chunk(chunk));
  }
  files.writes("-o", options.output, CommandFiles::Dash::stream).prepare();
  const auto place = identity_of(std::filesystem::absolute(options.output).parent_path());
  if (options.output != "-" && place && place == identity_of(folder.chunks())) {
    refuse_flag("-o", options.output, "lies among the chunks that are merged; choose another name");
  }
}

void merge(const MergeArguments& options) {
  const ResultsFolder folder(options.results);
  if (!folder.has_task()) {
    refuse(folder.path(), "is no folder of results; give the one that palpate batch -o names");
  }
  const BatchTask task = read_batch_task(folder.task());
  const std::size_t chunks = task.chunks();
  const std::size_t unknowns = task.unknowns();
  const std::vector<std::size_t> there = folder.finished_chunks(chunks);
  check_output(options, folder, there);
  const std::string missing = missing_unknowns(there, task);
  if (!missing.empty() && !options.partial) {
    refuse(folder.path(),
           "{} of {} chunks are missing (unknowns {}); call palpate batch again to complete them, "
           "or give --partial",
           chunks - there.size(), chunks, missing);
  }
  std::optional<AtomicFile> file;
  if (options.output != "-") {
    file.emplace(options.output);
  }
  std::size_t done = 0;
  std::size_t failed = 0;
  for (const std::size_t chunk : there) {
    const std::size_t records =
        std::min(task.chunk_unknowns, unknowns - chunk * task.chunk_unknowns);
    const Chunk read = read_chunk(folder.chunk(chunk), records);
    done += records;
    failed += read.failed;
    if (file) {
      file->append(read.text);
    } else {
      fmt::print("{}", read.text);
    }
  }
  if (file) {
    file->commit();
  }
  fmt::print(stderr, "{}: {} of {} unknowns, {} failed{}\n", options.results, done, unknowns,
             failed, missing.empty() ? "" : "; missing: " + missing);
}

}  // namespace

void add_merge(CLI::App& app) {
  const auto [command, options] =
      add_command<MergeArguments>(app, "merge",
                                  "Join the results of palpate batch: one record a line (NDJSON), "
                                  "in the order of the inputs. Says what is missing",
                                  merge);
  add_required(*command, "RESULTS", options->results, "Folder of results of palpate batch");
  command->add_option("-o,--output", options->output,
                      "File to write; - is standard output [default: -]");
  command->add_flag("--partial", options->partial,
                    "Join what is there, instead of refusing where chunks are missing");
}

}  // namespace palpate::cli
