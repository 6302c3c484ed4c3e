#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <filesystem>
#include <utility>

namespace palpate {

/// Owns an open file descriptor.
class Descriptor {
 public:
  Descriptor() = default;
  /// Takes over an open close-on-exec descriptor; a negative one stays invalid and keeps errno.
  explicit Descriptor(int descriptor) : descriptor_(descriptor) {}
  /// Opens a file; invalid, with errno, where that fails.
  Descriptor(const std::filesystem::path& path, int flags, mode_t mode = 0)
      : Descriptor(::open(path.c_str(), flags | O_CLOEXEC, mode)) {}
  ~Descriptor() {
    if (valid()) {
      ::close(descriptor_);
    }
  }
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

}  // namespace palpate
