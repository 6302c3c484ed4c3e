#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

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
  /// Makes the folders that are missing, and removes what killed processes have left half-written
  /// a day ago or before. @throws Error where a folder cannot be made
  void make() const;

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

}  // namespace palpate::cli
