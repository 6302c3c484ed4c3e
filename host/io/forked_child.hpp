#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>

#include "descriptor.hpp"

namespace palpate {

/// What a forked child may use up at first, and how long it may say nothing.
struct ForkedLimits {
  std::uint64_t cpu_seconds;
  std::uint64_t memory_bytes;         ///< on top of what the process holds already
  std::chrono::milliseconds silence;  ///< longest wait for each byte of an answer
};

/// A forked child that answers requests over a socket. Whatever happens to the child, crash,
/// endless loop, endless wait or corrupted heap, the caller goes on: read() says that there is no
/// answer, and what was read must be checked by its content. The child ends with this object; it
/// prints nothing, dumps no core, runs no exit handlers, and must touch no device and start no
/// thread.
class ForkedChild {
 public:
  /// What the child does: answers on the descriptor with forked_read() and forked_write().
  using Work = std::function<void(int socket)>;

  /// @param held is held while the process forks, and no longer: what another thread does under it
  /// is not cut in two in the child.
  /// @throws Error (Fault::system) where the system refuses another process.
  ForkedChild(const Work& work, const ForkedLimits& limits, std::mutex& held);
  ~ForkedChild();
  ForkedChild(const ForkedChild&) = delete;
  ForkedChild& operator=(const ForkedChild&) = delete;

  /// Reads exactly so many bytes; false where the child has ended or been silent for too long.
  bool read(void* data, std::size_t bytes);
  /// Whether read() gave up a child that was silent for too long.
  bool fell_silent() const { return fell_silent_; }
  /// Sends a request; false where the child has ended.
  bool write(const void* data, std::size_t bytes);

 private:
  pid_t pid_ = -1;
  Descriptor socket_;
  std::chrono::milliseconds silence_;
  bool fell_silent_ = false;
};

// For `work`, in the child.

/// Reads exactly so many bytes; ends the child where its parent has none.
void forked_read(int socket, void* data, std::size_t bytes);
/// Writes all bytes; ends the child where that fails.
void forked_write(int socket, const void* data, std::size_t bytes);
/// From here on the child may use so much more time of a processor, or up to a second less.
void allow_cpu_seconds(std::uint64_t seconds);
/// The child may hold so much memory beyond what it holds now.
void allow_memory_bytes(std::uint64_t bytes);

}  // namespace palpate
