#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/descriptor.hpp"
#include "palpate/device.hpp"

namespace palpate::cli {

/// One of `count` parts of the chunks of a results folder: chunk k belongs to shard k mod count.
struct Shard {
  std::size_t index = 0;
  std::size_t count = 1;
};

/// Most shards of a results folder.
inline constexpr std::size_t most_shards = 1'000'000;

/// The number in a variable that Slurm sets; none where it is not set.
/// @throws Error (Fault::input) where it holds no whole number
std::optional<std::size_t> slurm_number(const char* variable);

/// The shard of a flag's "I/N" or, where it is "", that of a Slurm task: one of a job array, whose
/// number Slurm tells by SLURM_ARRAY_TASK_ID, _MIN, _STEP and _COUNT, one of the tasks that srun
/// started (SLURM_PROCID of SLURM_STEP_NUM_TASKS), or both. Otherwise the whole.
/// @throws Error (Fault::input) on anything else than 0 <= I < N, and on an array whose task
/// numbers are not evenly spaced
Shard shard_of(const std::string& flag);

/// The device, as an index or a name, that a process takes which is the `rank`-th on its computer:
/// of several usable devices with the name of the one that is chosen, each process takes another
/// in turn. `wished` where there is only one, or where it is an index.
/// @param devices Device::list(wished)
std::string local_device(std::span<const DeviceInfo> devices, const std::string& wished,
                         std::size_t rank);

/// The files of a results folder, see docs/files.md: task.ndjson says what is computed,
/// chunks/K.ndjson holds the records of some successive unknowns, runs/K.json how they came about.
class ResultsFolder {
 public:
  explicit ResultsFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  const std::filesystem::path& path() const { return folder_; }
  std::filesystem::path task() const { return folder_ / "task.ndjson"; }
  std::filesystem::path chunks() const { return folder_ / "chunks"; }
  std::filesystem::path runs() const { return folder_ / "runs"; }
  std::filesystem::path lock() const { return folder_ / "lock"; }
  std::filesystem::path chunk(std::size_t index) const;
  std::filesystem::path run(std::size_t index) const;

  bool has_task() const;
  /// Requires that a batch may write here: the folder has a task, or is missing or empty but for
  /// what a batch leaves that is killed before it writes its task; and no link leads a batch's
  /// files out of it.
  /// @throws Error (Fault::input)
  void require_own() const;
  /// The chunks whose files are there, in order. Chunk files appear whole, so that these are
  /// finished.
  /// @param end the first chunk that is not looked for
  /// @throws Error (Fault::input) where the folder cannot be read
  std::vector<std::size_t> finished_chunks(std::size_t end = SIZE_MAX) const;
  /// Makes the folders that are missing. @throws Error where that is impossible
  void make() const;
  /// Removes a chunk that is to be computed again. @throws Error (Fault::system)
  void remove_chunk(std::size_t index) const;
  /// Removes what killed processes have left half-written.
  void remove_parts() const;

 private:
  /// Something that no batch has made; none where there is none.
  std::optional<std::filesystem::path> foreign_file() const;

  std::filesystem::path folder_;
};

/// The records of a chunk file.
struct Chunk {
  std::string text;        ///< a record a line
  std::size_t failed = 0;  ///< records with an error
};
/// @throws Error on a line that is no record, and where there are not as many as unknowns
Chunk read_chunk(const std::filesystem::path& file, std::size_t unknowns);

/// Keeps processes apart that work on one results folder. The locks are the kernel's (fcntl), so
/// that they end with their process however it ends, also over NFS, and forked children do not
/// inherit them.
class FolderLock {
 public:
  /// Takes the lock of this shard.
  /// @param wait called where another process works on this shard, or on a shard of another count;
  /// looks again where it returns true. By default it waits for a second in all: a process that was
  /// killed keeps its locks until the kernel has taken it apart.
  /// @throws Error (Fault::input) where the other process still works on it, and where the folder
  /// cannot be written
  FolderLock(const ResultsFolder& folder, const Shard& shard,
             const std::function<bool()>& wait = wait_for_a_second());

  /// Waits until no other process settles the folder's task, and keeps others waiting.
  void lock() const;
  void unlock() const;
  /// Whether no other process works on the folder; only between lock() and unlock().
  bool is_alone() const;

 private:
  static std::function<bool()> wait_for_a_second();
  /// Takes the lock, or returns the shard that another process works on.
  std::optional<Shard> take() const;

  std::filesystem::path file_;
  Shard shard_;
  Descriptor descriptor_;
};

}  // namespace palpate::cli
