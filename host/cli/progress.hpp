#pragma once

#include <chrono>
#include <cstdio>
#include <functional>
#include <string>

namespace palpate::cli {

/// Shows a progress line on a terminal once the work has taken two seconds; erases it at the end.
class Progress {
 public:
  using Clock = std::chrono::steady_clock;

  /// @param what names the work, such as "building maps"
  /// @param output where the line is shown; nothing is shown if it is not a terminal
  /// @param now the clock
  explicit Progress(std::string what, std::FILE* output = stderr,
                    std::function<Clock::time_point()> now = Clock::now);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Shows the fraction of the work that is done, in [0, 1], and what else is to be said of it.
  void show(double fraction, const std::string& more = "");

 private:
  std::string what_;
  std::FILE* output_;
  std::function<Clock::time_point()> now_;
  Clock::time_point start_;
  Clock::time_point shown_;
  bool visible_ = false;
};

/// The result of work that calls its argument now and then with the fraction done.
template <typename Work>
auto with_progress(const char* what, const Work& work) {
  Progress progress(what);
  return work([&](double fraction) { progress.show(fraction); });
}

}  // namespace palpate::cli
