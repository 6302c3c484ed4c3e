#pragma once

#include <filesystem>
#include <memory>

#include "palpate/touch.hpp"

namespace palpate {

struct Hdf5Child;

/// Reads recordings one after the other in one forked child, which costs a fraction of a child for
/// each of them. A file that takes the child down is read again by read_recording(), which says
/// what is wrong with it, and the next file has a new child. For one thread at a time.
class RecordingReader {
 public:
  /// Forks the child where read_hdf5_in_children(). To be made before other threads work: what they
  /// hold locked at the fork, the memory of a sanitizer, say, stays locked in the child for ever.
  /// @throws Error (Fault::system) where the system refuses another process
  RecordingReader();

  /// Returns what read_recording() does.
  /// @throws Error as read_recording() does
  Recording read(const std::filesystem::path& path);

 private:
  std::shared_ptr<Hdf5Child> child_;
};

}  // namespace palpate
