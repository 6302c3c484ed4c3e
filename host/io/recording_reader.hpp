#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "palpate/touch.hpp"

namespace palpate {

class ForkedChild;

/// Reads recordings of touches one after the other in one forked child, which costs a fraction of a
/// child for each of them. A file that takes the child down is read again by read_recording(),
/// which says what is wrong with it, and the next file has a new child. For one thread at a time.
class RecordingReader {
 public:
  /// Forks the child where read_hdf5_in_children(). To be made before other threads work: what they
  /// hold locked at the fork, the memory of a sanitizer, say, stays locked in the child for ever.
  /// @throws Error (Fault::system) where the system refuses another process
  RecordingReader();
  ~RecordingReader();
  RecordingReader(const RecordingReader&) = delete;
  RecordingReader& operator=(const RecordingReader&) = delete;

  /// Returns what read_recording() does, but for times and the fields of a stream.
  /// @throws Error as read_recording() does
  Recording read(const std::filesystem::path& path);

 private:
  void fork_child();
  /// None where the child fails.
  std::optional<Recording> read_in_child(const std::filesystem::path& path);

  std::unique_ptr<ForkedChild> child_;
};

}  // namespace palpate
