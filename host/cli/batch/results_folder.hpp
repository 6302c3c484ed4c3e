#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "descriptor.hpp"
#include "shard.hpp"

namespace palpate::cli {

/// The files of a results folder, see docs/files.md: task.ndjson says what is computed,
/// chunks/K.ndjson holds the records of some successive unknowns, runs/K.json how they came about.
class ResultsFolder {
 public:
  explicit ResultsFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  const std::filesystem::path& path() const { return folder_; }
  std::filesystem::path task() const { return folder_ / "task.ndjson"; }
  std::filesystem::path chunks() const { return folder_ / "chunks"; }
  std::filesystem::path runs() const { return folder_ / "runs"; }
  std::filesystem::path chunk(std::size_t index) const;
  std::filesystem::path run(std::size_t index) const;

  bool has_task() const;
  /// Chunk files appear whole, so that one that is there is finished.
  bool has_chunk(std::size_t index) const;
  /// Makes the folders that are missing. @throws Error where that is impossible
  void make() const;
  /// Removes a chunk that is to be computed again. @throws Error (Fault::system)
  void remove_chunk(std::size_t index) const;
  /// Removes the chunks from `first` on. @throws Error (Fault::system)
  void remove_chunks_from(std::size_t first) const;
  /// Removes what killed processes have left half-written.
  void remove_parts() const;

 private:
  std::filesystem::path folder_;
};

/// Whether an argument is a results folder.
bool is_results_folder(const std::filesystem::path& folder);

/// What the text of a chunk file holds.
struct ChunkCounts {
  std::size_t records = 0;
  std::size_t failed = 0;  ///< records with an error
};
ChunkCounts count_records(std::string_view chunk);

/// Keeps processes apart that work on one results folder. The locks are the kernel's (fcntl), so
/// that they end with their process however it ends, also over NFS, and forked children do not
/// inherit them.
class FolderLock {
 public:
  /// Takes the lock of this shard.
  /// @throws Error (Fault::input) where another process works on this shard, or on a shard of
  /// another count, and where the folder cannot be written
  FolderLock(const ResultsFolder& folder, const Shard& shard);

  /// Waits until no other process settles the folder's task, and keeps others waiting.
  void begin_settling() const;
  void end_settling() const;
  /// Whether no other process works on the folder; only between begin_ and end_settling().
  bool is_alone() const;

 private:
  std::filesystem::path file_;
  Shard shard_;
  Descriptor descriptor_;
};

}  // namespace palpate::cli
