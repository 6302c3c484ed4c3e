#include "io/standard_streams.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>

namespace palpate {

namespace {

std::array<bool, 3> closed{};

}  // namespace

void open_closed_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) != -1) {
      continue;
    }
    closed[static_cast<std::size_t>(stream)] = true;
    // open() takes the lowest free number, which is this stream's. Without /dev, a folder takes it,
    // and printing fails.
    if (::open("/dev/null", O_RDWR) < 0) {
      ::open("/", O_RDONLY | O_DIRECTORY);
    }
  }
}

bool was_closed(int stream) { return closed.at(static_cast<std::size_t>(stream)); }

}  // namespace palpate
