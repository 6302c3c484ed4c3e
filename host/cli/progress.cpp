#include "progress.hpp"

#include <unistd.h>

#include <cstdio>

#include <fmt/format.h>

namespace palpate::cli {

using namespace std::chrono_literals;

void Progress::show(double fraction) {
  const auto now = std::chrono::steady_clock::now();
  if (now - start_ < 2s || now - shown_ < 100ms || isatty(STDERR_FILENO) == 0) {
    return;
  }
  shown_ = now;
  visible_ = true;
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  const double left = fraction > 0.0 ? elapsed * (1.0 - fraction) / fraction : 0.0;
  // Carriage return, text, erase to the end of the line.
  fmt::print(stderr, "\r{} {:3.0f} %, {:.0f} s left\033[K", what_, 100.0 * fraction, left);
  std::fflush(stderr);
}

Progress::~Progress() {
  if (visible_) {
    std::fputs("\r\033[K", stderr);
    std::fflush(stderr);
  }
}

}  // namespace palpate::cli
