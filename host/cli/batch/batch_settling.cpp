#include "batch_settling.hpp"

#include <filesystem>
#include <unordered_map>
#include <utility>

#include "palpate/error.hpp"
#include "progress.hpp"
#include "sensor_model_flag.hpp"

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

/// Hashes of the files that the recognition depends on.
std::map<std::string, std::string> hashes_of(const RecognitionFlags& flags, const Scene& scene,
                                             const RecognitionTask& recognition) {
  std::map<std::string, std::string> hashes;
  const auto add = [&](const std::string& file) {
    if (!file.empty() && !hashes.contains(file)) {
      hashes[file] = hash_of_file(file);
    }
  };
  add(flags.scene);
  add(scene.array_file ? scene.array_file->string() : "");
  add(sensor_model_file(flags, scene));
  for (const std::string& map : recognition.map_paths) {
    add(map);
  }
  return hashes;
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

RecognitionTask recognition_of(const BatchTask& task, const RecognitionFlags& flags,
                               const InputRules& rules) {
  const BatchInference& inferred = task.inferred;
  RecognitionTask recognition =
      task_of(flags, rules.scene, inferred.pressure_unit, inferred.unit_from, inferred.reach_mm);
  if (auto* histogram = std::get_if<HistogramOptions>(&recognition.filter)) {
    histogram->still_array = inferred.still_array;
  }
  return recognition;
}

}  // namespace

SettledBatch settle_batch(const ResultsFolder& folder, const FolderLock& lock, BatchTask now,
                          const RecognitionFlags& flags, const InputRules& rules, bool update,
                          std::size_t threads) {
  const Settling settling(folder, lock);
  std::optional<BatchTask> before;
  if (folder.has_task()) {
    before = read_batch_task(folder.task());
    settling.require_equal(
        difference_of_tasks(
            {.program = before->program,
             .chunk_unknowns = before->chunk_unknowns,
             .flags = before->flags},
            {.program = now.program, .chunk_unknowns = now.chunk_unknowns, .flags = now.flags}),
        update, recognise_all);
  }
  for (BatchEntry& entry : now.inputs) {
    entry.stamp = stamp_of(entry.input.path);
  }
  if (before) {
    settling.require_equal(difference_of_inputs(*before, now), update, recognise_changed);
    keep_surveys(*before, now);
  }
  if (now.each_frame || infers_region(flags, rules.scene)) {
    Progress progress("looking through the recordings");
    survey_inputs(now.inputs, rules, threads, [&](double done) { progress.show(done); });
  }
  const bool same_inputs = before && before->inputs == now.inputs;
  now.inferred = same_inputs ? before->inferred : infer(now.inputs, rules);
  RecognitionTask asked = recognition_of(now, flags, rules);
  SettledBatch settled{std::move(now), std::move(asked), {}};
  BatchTask& task = settled.task;
  RecognitionTask& recognition = settled.recognition;
  task.files = hashes_of(flags, rules.scene, recognition);
  const std::string difference = before ? difference_of_tasks(*before, task) : "";
  settling.require_equal(difference, update, recognise_all);
  const bool same_task = before && difference.empty();
  if (same_task) {
    task.bins = before->bins;
    recognition.lattice().x_mm.count = task.bins[0];
    recognition.lattice().y_mm.count = task.bins[1];
    recognition.lattice().theta_rad.count = task.bins[2];
    recognition.bin_width.reset();
  } else if (recognition.bin_width) {
    settled.device = open_device(flags, rules.scene);
  }
  const std::string coarsened =
      settled.device ? settle_task(flags, rules.scene, *settled.device, recognition) : "";
  if (!settled.device) {
    settle_filter(recognition);
    settle_evidence(recognition);
  }
  task.bins = {recognition.lattice().x_mm.count, recognition.lattice().y_mm.count,
               recognition.lattice().theta_rad.count};
  if (!coarsened.empty()) {
    flags.tell(coarsened);
  }
  if (same_task && same_inputs) {
    return settled;
  }
  // Results go before the task that they belong to: a process that is killed in between leaves the
  // older task, and less of it.
  const std::vector<bool> kept =
      same_task ? equal_chunks(*before, task) : std::vector<bool>(task.chunks());
  for (std::size_t chunk = 0; chunk < kept.size(); ++chunk) {
    if (!kept[chunk]) {
      folder.remove_chunk(chunk);
    }
  }
  folder.remove_chunks_from(task.chunks());
  write_batch_task(folder.task(), task);
  return settled;
}

}  // namespace palpate::cli
