#include "cli/progress.hpp"

#include <unistd.h>

#include <utility>

#include <fmt/format.h>

namespace palpate::cli {

using namespace std::chrono_literals;

Progress::Progress(std::string what, std::FILE* output, std::function<Clock::time_point()> now)
    : what_(std::move(what)),
      output_(output),
      now_(std::move(now)),
      start_(now_()),
      shown_(start_) {}

void Progress::show(double fraction, const std::string& more) {
  const auto now = now_();
  if (now - start_ < 2s || now - shown_ < 100ms || isatty(fileno(output_)) == 0) {
    return;
  }
  shown_ = now;
  visible_ = true;
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  const std::string left =
      fraction > 0.0 ? fmt::format(", {:.0f} s left", elapsed * (1.0 - fraction) / fraction)
                     : fmt::format(", {:.0f} s so far", elapsed);
  // Carriage return, text, erase to the end of the line.
  const std::string line =
      fmt::format("\r{} {:3.0f} %{}{}\033[K", what_, 100.0 * fraction, more, left);
  std::fputs(line.c_str(), output_);  // not fmt::print, which throws if the terminal is closed
  std::fflush(output_);
}

Progress::~Progress() {
  if (visible_) {
    std::fputs("\r\033[K", output_);
    std::fflush(output_);
  }
}

}  // namespace palpate::cli
