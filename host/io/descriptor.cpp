#include "io/descriptor.hpp"

#include <unistd.h>

namespace palpate {

Descriptor::Descriptor(const std::filesystem::path& path, int flags, mode_t mode)
    : Descriptor(::open(path.c_str(), flags | O_CLOEXEC, mode)) {}

Descriptor::~Descriptor() {
  if (valid()) {
    ::close(descriptor_);
  }
}

void open_closed_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    // open() takes the lowest free number, which is this stream's.
    if (::fcntl(stream, F_GETFD) == -1 && ::open("/dev/null", O_RDWR) < 0) {
      return;
    }
  }
}

}  // namespace palpate
