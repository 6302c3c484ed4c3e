#include "io/descriptor.hpp"

#include <unistd.h>

#include <cerrno>

namespace palpate {

namespace {

constexpr int first_own = 3;  // after standard input, output and error

std::array<bool, first_own> closed_streams{};

int above_standard(int descriptor) {
  if (descriptor < 0 || descriptor >= first_own) {
    return descriptor;
  }
  const int moved = ::fcntl(descriptor, F_DUPFD_CLOEXEC, first_own);
  const int reason = errno;
  ::close(descriptor);
  errno = reason;
  return moved;
}

}  // namespace

Descriptor::Descriptor(int descriptor) : descriptor_(above_standard(descriptor)) {}

Descriptor::Descriptor(const std::filesystem::path& path, int flags, mode_t mode)
    : Descriptor(::open(path.c_str(), flags | O_CLOEXEC, mode)) {}

Descriptor::~Descriptor() {
  if (valid()) {
    ::close(descriptor_);
  }
}

StandardDescriptorsTaken::StandardDescriptorsTaken() {
  for (int& place : taken_) {
    const int opened = ::open("/dev/null", O_RDWR | O_CLOEXEC);
    if (opened >= first_own) {
      ::close(opened);
      return;
    }
    place = opened;
  }
}

StandardDescriptorsTaken::~StandardDescriptorsTaken() {
  for (const int place : taken_) {
    if (place >= 0) {
      ::close(place);
    }
  }
}

void open_closed_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) != -1) {
      continue;
    }
    closed_streams[static_cast<std::size_t>(stream)] = true;
    // open() takes the lowest free number, which is this stream's. Without /dev, a folder takes it,
    // and printing fails.
    if (::open("/dev/null", O_RDWR) < 0) {
      ::open("/", O_RDONLY | O_DIRECTORY);
    }
  }
}

bool was_closed(int stream) { return closed_streams.at(static_cast<std::size_t>(stream)); }

}  // namespace palpate
