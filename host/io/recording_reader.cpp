#include "io/recording_reader.hpp"

#include <system_error>

#include "io/hdf5_contents.hpp"
#include "io/recording_scan.hpp"
#include "palpate/error.hpp"
#include "palpate/files.hpp"

namespace palpate {

namespace {

/// Files beyond this have a child of their own: its cost is small beside theirs.
constexpr std::uint64_t most_file_bytes = 16 << 20;

}  // namespace

RecordingReader::RecordingReader() {
  if (reads_hdf5_in_children()) {
    child_ = recording_child(most_file_bytes);
  }
}

Recording RecordingReader::read(const std::filesystem::path& path) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  if (error || bytes > most_file_bytes || !reads_hdf5_in_children()) {
    return read_recording(path);
  }
  if (!child_) {
    child_ = recording_child(most_file_bytes);
  }
  try {
    return recording_read_by(path, child_.get());
  } catch (const Error&) {
    if (child_->in_step) {
      throw;
    }
  }
  child_.reset();  // another file may have damaged its memory
  return read_recording(path);
}

}  // namespace palpate
