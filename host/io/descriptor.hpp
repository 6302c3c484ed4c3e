#pragma once

#include <fcntl.h>

#include <array>
#include <filesystem>
#include <utility>

namespace palpate {

/// Owns an open file descriptor other than 0, 1 and 2: where a daemon has closed these, whatever
/// the process prints would go into the file.
class Descriptor {
 public:
  Descriptor() = default;
  /// Takes over an open close-on-exec descriptor; a negative one stays invalid and keeps errno.
  explicit Descriptor(int descriptor);
  /// Opens a file; invalid, with errno, where that fails.
  Descriptor(const std::filesystem::path& path, int flags, mode_t mode = 0);
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    return *this;
  }

  int get() const { return descriptor_; }
  bool valid() const { return descriptor_ >= 0; }

 private:
  int descriptor_ = -1;
};

/// Occupies the descriptors 0, 1 and 2 while it lives, so that a library that opens a file by name
/// gets none of them.
class StandardDescriptorsTaken {
 public:
  StandardDescriptorsTaken();
  ~StandardDescriptorsTaken();
  StandardDescriptorsTaken(const StandardDescriptorsTaken&) = delete;
  StandardDescriptorsTaken& operator=(const StandardDescriptorsTaken&) = delete;

 private:
  std::array<int, 3> taken_{-1, -1, -1};
};

/// Opens /dev/null in place of closed standard streams, as a daemon may have. Otherwise the first
/// files opened would take their numbers, and what is printed would go into them. Call it first in
/// main().
void open_closed_streams();

/// True where this stream (0 to 2) was closed when open_closed_streams() was called.
bool was_closed(int stream);

}  // namespace palpate
