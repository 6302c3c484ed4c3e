#pragma once

#include <fcntl.h>

#include <array>
#include <filesystem>
#include <utility>

namespace palpate {

/// Owns an open file of the operating system. Its number is never 0, 1 or 2: where a daemon has
/// closed those, whatever the process prints would go into the file.
class Descriptor {
 public:
  Descriptor() = default;
  /// Takes over an open descriptor, which is closed on the program's exec; a negative one stays
  /// invalid and leaves errno as it is.
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

/// While this lives, the descriptors 0, 1 and 2 are taken, so that a library which opens a file by
/// its name is given none of them.
class StandardDescriptorsTaken {
 public:
  StandardDescriptorsTaken();
  ~StandardDescriptorsTaken();
  StandardDescriptorsTaken(const StandardDescriptorsTaken&) = delete;
  StandardDescriptorsTaken& operator=(const StandardDescriptorsTaken&) = delete;

 private:
  std::array<int, 3> taken_{-1, -1, -1};
};

}  // namespace palpate
