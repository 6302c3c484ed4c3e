#include "io/recording_state.hpp"

#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "io/descriptor.hpp"

namespace palpate {

bool is_marked_open(const std::filesystem::path& path) {
  // Layout of the superblock in HDF5's file format specification: signature, version, two sizes
  // and, from version 2 on, the flags of its writers.
  constexpr char signature[] = {'\x89', 'H', 'D', 'F', '\r', '\n', '\x1a', '\n'};
  constexpr std::size_t version = 8;
  constexpr std::size_t flags = 11;
  char bytes[flags + 1] = {};
  const Descriptor file(path, O_RDONLY);
  return file.valid() && ::pread(file.get(), bytes, sizeof bytes, 0) == sizeof bytes &&
         std::memcmp(bytes, signature, sizeof signature) == 0 && bytes[version] >= 2 &&
         bytes[flags] != 0;
}

void mark_as_being_recorded(int descriptor) { ::flock(descriptor, LOCK_SH | LOCK_NB); }

Recorder recorder_of(const std::filesystem::path& path) {
  const Descriptor file(path, O_RDONLY);
  if (file.valid() && ::flock(file.get(), LOCK_EX | LOCK_NB) == 0) {
    return Recorder::gone;
  }
  return file.valid() && errno == EWOULDBLOCK ? Recorder::there : Recorder::unknown;
}

}  // namespace palpate
