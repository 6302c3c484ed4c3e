#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <vector>

#include "io/descriptor.hpp"

namespace palpate {

/// Initial limits of a forked child.
struct ForkedLimits {
  std::uint64_t cpu_seconds;
  std::uint64_t memory_bytes;         ///< on top of what the process holds
  std::chrono::milliseconds silence;  ///< longest wait for each byte of an answer
};

/// A forked child that answers requests over a socket. The caller survives whatever happens to the
/// child (crash, endless loop or wait, corrupted heap): read() then returns false. What was read
/// must be checked by its content. The child ends with this object, prints nothing, dumps no core
/// and runs no exit handlers. It must touch no device and start no thread.
class ForkedChild {
 public:
  /// Runs in the child and answers on the socket with forked_read() and forked_write().
  using Work = std::function<void(int socket)>;

  /// @param held locked only while the process forks, so that the child inherits no half-done work
  /// of another thread that locks it
  /// @throws Error (Fault::system) where the system refuses another process
  ForkedChild(const Work& work, const ForkedLimits& limits, std::mutex& held);
  ~ForkedChild();
  ForkedChild(const ForkedChild&) = delete;
  ForkedChild& operator=(const ForkedChild&) = delete;

  /// Reads exactly this many bytes; false where the child has ended or been silent for too long.
  bool read(void* data, std::size_t bytes);
  /// Reads what ForkedSender::list() sends; false where read() fails or the list takes more than
  /// `most_bytes`.
  template <class List>
  bool list(List& values, std::uint64_t most_bytes) {
    constexpr std::uint64_t width = sizeof(typename List::value_type);
    std::uint64_t count = 0;
    if (!read(&count, sizeof count) || count > most_bytes / width) {
      return false;
    }
    values.resize(count);
    return read(values.data(), count * width);
  }
  /// True where read() gave up a child that was silent for too long.
  bool fell_silent() const { return fell_silent_; }
  /// Sends a request; false where the child has ended.
  bool write(const void* data, std::size_t bytes);

 private:
  /// Reads what the child has sent so far, at most so many bytes; 0 where that fails.
  std::size_t receive(char* data, std::size_t most);

  pid_t pid_ = -1;
  Descriptor socket_;
  std::vector<char> received_;  ///< what was received together with what was asked for
  std::size_t next_ = 0;        ///< the first byte of these that was not asked for yet
  std::chrono::milliseconds silence_;
  bool fell_silent_ = false;
};

// What follows is for `work`, in the child.

/// Reads exactly this many bytes; ends the child where the parent sends no more.
void forked_read(int socket, void* data, std::size_t bytes);
/// Writes all bytes; ends the child where that fails.
void forked_write(int socket, const void* data, std::size_t bytes);

/// Writes an answer as forked_write() does, small parts of it together.
class ForkedSender {
 public:
  explicit ForkedSender(int socket) : socket_(socket) {}

  template <class Value>
  void value(const Value& value) {
    put(&value, sizeof value);
  }
  /// Sends values or a text: their number as a 64-bit integer, then their bytes.
  template <class List>
  void list(const List& values) {
    value(std::uint64_t{values.size()});
    put(values.data(), values.size() * sizeof(typename List::value_type));
  }
  /// Writes what has waited for more.
  void flush();

 private:
  void put(const void* data, std::size_t bytes);

  int socket_;
  std::vector<char> waiting_;
};

/// Allows the child this much more processor time, or up to a second less.
void allow_cpu_seconds(std::uint64_t seconds);
/// Allows the child this much memory beyond what it holds now.
void allow_memory_bytes(std::uint64_t bytes);

}  // namespace palpate
