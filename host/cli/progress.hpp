#pragma once

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <functional>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace palpate::cli {

/// Shows a progress line on a terminal once the work has taken two seconds; erases it at the end.
class Progress {
 public:
  using Clock = std::chrono::steady_clock;

  /// @param what names the work, such as "building maps"
  /// @param output where the line is shown; nothing is shown if it is not a terminal
  /// @param now the clock
  explicit Progress(std::string what, std::FILE* output = stderr,
                    std::function<Clock::time_point()> now = Clock::now)
      : what_(std::move(what)), output_(output), now_(std::move(now)), start_(now_()) {}
  ~Progress() {
    if (visible_) {
      std::fputs("\r\033[K", output_);
      std::fflush(output_);
    }
  }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Shows the fraction of the work that is done, in [0, 1], and what else is to be said of it.
  void show(double fraction, const std::string& more = "") {
    const auto now = now_();
    if (now - start_ < std::chrono::seconds(2) || now - shown_ < std::chrono::milliseconds(100) ||
        isatty(fileno(output_)) == 0) {
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

 private:
  std::string what_;
  std::FILE* output_;
  std::function<Clock::time_point()> now_;
  Clock::time_point start_;
  Clock::time_point shown_ = start_;
  bool visible_ = false;
};

/// The result of work that calls its argument now and then with the fraction done.
template <typename Work>
auto with_progress(const char* what, const Work& work) {
  Progress progress(what);
  return work([&](double fraction) { progress.show(fraction); });
}

}  // namespace palpate::cli
