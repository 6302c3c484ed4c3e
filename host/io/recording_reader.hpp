#pragma once

#include <filesystem>
#include <memory>

#include "palpate/touch.hpp"

namespace palpate {

class ForkedChild;

/// Reads recordings of touches one after the other in one forked child, which costs a fraction of a
/// child for each of them. A file on which the child fails is read again by read_recording(), which
/// says what is wrong with it, and the next file has a new child. For one thread.
class RecordingReader {
 public:
  RecordingReader();
  ~RecordingReader();
  RecordingReader(const RecordingReader&) = delete;
  RecordingReader& operator=(const RecordingReader&) = delete;

  /// Returns what read_recording() does, but for times and the fields of a stream.
  /// @throws Error as read_recording() does
  Recording read(const std::filesystem::path& path);

 private:
  /// False where the child fails.
  bool read_in_child(const std::filesystem::path& path, Recording& recording);

  std::unique_ptr<ForkedChild> child_;
};

}  // namespace palpate
