#include <algorithm>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "atomic_file.hpp"
#include "batch_task.hpp"
#include "command_files.hpp"
#include "commands.hpp"
#include "input_file.hpp"
#include "options.hpp"
#include "results_folder.hpp"

namespace palpate::cli {

namespace {

struct Options {
  std::string results;
  std::string output = "-";
  bool partial = false;
};

/// "100 to 199, 300 to 349", shortened.
std::string ranges_of(const std::vector<std::size_t>& chunks, const BatchTask& task) {
  constexpr std::size_t most = 3;
  std::string text;
  std::size_t ranges = 0;
  for (std::size_t i = 0; i < chunks.size();) {
    std::size_t end = i + 1;
    while (end < chunks.size() && chunks[end] == chunks[end - 1] + 1) {
      ++end;
    }
    if (ranges++ == most) {
      return text + ", and more";
    }
    text += fmt::format("{}{} to {}", text.empty() ? "" : ", ", chunks[i] * task.chunk_unknowns,
                        std::min((chunks[end - 1] + 1) * task.chunk_unknowns, task.unknowns()) - 1);
    i = end;
  }
  return text;
}

void merge(const Options& options) {
  const ResultsFolder folder(options.results);
  if (!folder.has_task()) {
    refuse(folder.path(), "is no folder of results; give the one that palpate batch -o names");
  }
  if (options.output != "-") {
    require_writable(options.output);
  }
  const BatchTask task = read_batch_task(folder.task());
  const std::size_t chunks = task.chunks();
  const std::size_t unknowns = task.unknowns();
  std::vector<std::size_t> missing;
  for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
    if (!folder.has_chunk(chunk)) {
      missing.push_back(chunk);
    }
  }
  if (!missing.empty() && !options.partial) {
    refuse(folder.path(),
           "{} of {} chunks are missing (unknowns {}); call palpate batch again to complete them, "
           "or give --partial",
           missing.size(), chunks, ranges_of(missing, task));
  }
  std::optional<AtomicFile> file;
  if (options.output != "-") {
    file.emplace(options.output);
  }
  ChunkCounts all;
  for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
    if (std::ranges::binary_search(missing, chunk)) {
      continue;
    }
    std::ifstream stream(folder.chunk(chunk), std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(stream), {}};
    const ChunkCounts counts = count_records(text);
    const std::size_t expected =
        std::min(task.chunk_unknowns, unknowns - chunk * task.chunk_unknowns);
    if (counts.records != expected) {
      refuse(folder.chunk(chunk),
             "has {} records instead of {}; remove it and call palpate batch again", counts.records,
             expected);
    }
    all.records += counts.records;
    all.failed += counts.failed;
    if (file) {
      file->append(text);
    } else {
      fmt::print("{}", text);
    }
  }
  if (file) {
    file->commit();
  }
  fmt::print(stderr, "{}: {} of {} unknowns, {} failed{}\n", options.results, all.records, unknowns,
             all.failed,
             missing.empty() ? "" : fmt::format("; missing: {}", ranges_of(missing, task)));
}

}  // namespace

void add_merge(CLI::App& app) {
  auto* command =
      app.add_subcommand("merge",
                         "Join the results of palpate batch: one record a line (NDJSON), in the "
                         "order of the inputs. Says what is missing");
  const auto options = std::make_shared<Options>();
  command->add_option("RESULTS", options->results, "Folder of results of palpate batch")
      ->required();
  command->add_option("-o,--output", options->output,
                      "File to write; - is standard output [default: -]");
  command->add_flag("--partial", options->partial,
                    "Join what is there, instead of refusing where chunks are missing");
  command->callback([options] { merge(*options); });
}

}  // namespace palpate::cli
