#include "cli/batch/batch_settling.hpp"

#include <algorithm>
#include <unordered_map>
#include <utility>

#include "cli/progress.hpp"
#include "cli/recognition_flags.hpp"
#include "io/input_file.hpp"
#include "recognition/batch/batch_resolution.hpp"
#include "recognition/batch/input_reading.hpp"

namespace palpate::cli {

namespace {

/// The surveys of inputs that are as they were.
void keep_surveys(const BatchTask& before, BatchTask& now) {
  std::unordered_map<std::string, const BatchEntry*> known;
  for (const BatchEntry& entry : before.inputs) {
    known[entry.input.path] = &entry;
  }
  for (BatchEntry& entry : now.inputs) {
    const auto found = known.find(entry.input.path);
    if (found != known.end() && found->second->input == entry.input &&
        found->second->stamp == entry.stamp) {
      entry.survey = found->second->survey;
    }
  }
}

class Settling {
 public:
  Settling(const ResultsFolder& folder, const FolderLock& lock) : folder_(folder), lock_(lock) {
    lock_.begin_settling();
    folder_.make();
    if (lock_.is_alone()) {
      folder_.remove_parts();
    }
  }
  ~Settling() { lock_.end_settling(); }
  Settling(const Settling&) = delete;
  Settling& operator=(const Settling&) = delete;

  /// Refuses what differs from the task that the folder has, unless it may be updated.
  void require_equal(const std::string& difference, bool update, const char* remedy) const {
    if (difference.empty()) {
      return;
    }
    if (!update) {
      refuse(folder_.path(), "{}; {}", difference, remedy);
    }
    if (!lock_.is_alone()) {
      refuse(folder_.path(), "{}, but other shards are at work; wait until they have ended",
             difference);
    }
  }

 private:
  const ResultsFolder& folder_;
  const FolderLock& lock_;
};

constexpr const char* recognise_all =
    "undo that, give another folder, or recognise all again with --update";
constexpr const char* recognise_changed =
    "undo that, give another folder, or recognise what has changed with --update";

}  // namespace

SettledBatch settle_batch(const ResultsFolder& folder, const FolderLock& lock, BatchTask now,
                          const Request& request, const std::function<Device()>& open, bool update,
                          std::size_t threads) {
  const Settling settling(folder, lock);
  std::optional<BatchTask> before;
  if (folder.has_task()) {
    before = read_batch_task(folder.task());
    settling.require_equal(
        difference_of_tasks(
            {.program = before->program,
             .chunk_unknowns = before->chunk_unknowns,
             .request = before->request},
            {.program = now.program, .chunk_unknowns = now.chunk_unknowns, .request = now.request}),
        update, recognise_all);
  }
  stamp_inputs(now);
  if (before) {
    settling.require_equal(difference_of_inputs(*before, now), update, recognise_changed);
    keep_surveys(*before, now);
  }
  {
    Progress progress("looking through the recordings");
    survey(now, request, threads, [&](double done) { progress.show(done); });
  }
  const bool same_inputs = before && before->inputs == now.inputs;
  now.inferred = same_inputs ? before->inferred : infer(now.inputs, request);
  hash_files(now, request);
  const std::string difference = before ? difference_of_tasks(*before, now) : "";
  settling.require_equal(difference, update, recognise_all);
  const bool same_task = before && difference.empty();
  if (same_task) {
    now.bins = before->bins;
  }
  std::optional<Device> device;
  RecognitionTask recognition =
      resolve_batch(now, request, [&]() -> const Device& { return device.emplace(open()); });
  if (!same_task) {
    std::ranges::for_each(recognition.remarks, tell_on_stderr);
  }
  SettledBatch settled{std::move(now), std::move(recognition), std::move(device)};
  const BatchTask& task = settled.task;
  if (same_task && same_inputs) {
    return settled;
  }
  // Results go before the task that they belong to: a process that is killed in between leaves the
  // older task, and less of it.
  const std::vector<bool> kept = same_task ? equal_chunks(*before, task) : std::vector<bool>();
  for (const std::size_t chunk : folder.finished_chunks()) {
    if (chunk >= kept.size() || !kept[chunk]) {
      folder.remove_chunk(chunk);
    }
  }
  write_batch_task(folder.task(), task);
  return settled;
}

}  // namespace palpate::cli
