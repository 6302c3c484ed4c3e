#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace palpate::cli {

struct ViewedFile;

/// Saved files, for a page to look at: recordings, maps, and what `recognize --json`, `live --json`
/// and `batch` wrote.
class ViewedFiles {
 public:
  /// Reads the files, or of folders what they hold.
  /// @throws Error naming the first that cannot be read or is none of these
  explicit ViewedFiles(std::span<const std::string> paths);
  ~ViewedFiles();

  /// [{name, kind}], kind "recording", "map" or "records", as the event "files".
  std::string list() const;
  /// The JSON behind a path, none where there is nothing:
  /// /file/I: a recording's array and the poses at the ends of its reach, or a map as map_json(),
  /// or of records a row for each: recording, touches, best, probability, truth, error_mm, fit and
  /// act; /file/I/rows/A: at most 64 of a recording's rows from A on: pressure, pose and time;
  /// /file/I/record/K: a record as it was written; of `live`, an unknown's lines as its trace;
  /// /file/I/map/K: the map of that record's pose, where the record names a file that is there.
  std::optional<std::string> get(const std::string& path) const;

 private:
  std::vector<ViewedFile> files_;
};

}  // namespace palpate::cli
