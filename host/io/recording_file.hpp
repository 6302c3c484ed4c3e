#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "palpate/touch.hpp"

namespace palpate {

class Hdf5Contents;

/// A recording without its rows, as a file announces it.
struct RecordingHead {
  /// Its texts, truth, `valid`, `baseline` and `closed`, and its elements where they are the same
  /// in all rows.
  Recording recording;
  std::uint64_t rows = 0;      ///< n
  std::uint64_t elements = 0;  ///< e
  bool array_changes = false;  ///< `elements` is [n, e, 2]
};

/// An open "palpate.recording" HDF5 file. It is read and checked as by Hdf5Contents.
class RecordingFile {
 public:
  /// Reads the head. @throws Error as read_recording() does
  explicit RecordingFile(const std::filesystem::path& path);
  ~RecordingFile();

  const RecordingHead& head() const { return head_; }
  /// Replaces in `rows` the pressures, poses, times, lost counts and, where the array changes,
  /// elements by those of `count` rows from `first` on. @throws Error as read_recording() does
  void read(std::uint64_t first, std::uint64_t count, Recording& rows) const;

 private:
  void read_texts();
  void read_extents();
  void read_elements();
  std::uint64_t complete_rows() const;
  std::vector<std::uint64_t> shape_of(const char* name) const;
  bool has(const char* name, const std::vector<std::vector<std::uint64_t>>& fitting) const;

  std::filesystem::path path_;
  std::unique_ptr<const Hdf5Contents> file_;
  std::uint64_t rows_ = UINT64_MAX;  ///< complete rows of a file that is not closed
  RecordingHead head_;
};

}  // namespace palpate
