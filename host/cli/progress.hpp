#pragma once

#include <chrono>
#include <cstdio>
#include <functional>
#include <string>

namespace palpate::cli {

/// A progress line on standard error, for work over two seconds and only when it is a terminal.
class Progress {
 public:
  using Clock = std::chrono::steady_clock;

  /// @param output shows the line, if it is a terminal
  /// @param now tells the time
  explicit Progress(std::string what, std::FILE* output = stderr,
                    std::function<Clock::time_point()> now = Clock::now);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Shows the fraction done, in [0, 1].
  void show(double fraction);

 private:
  std::string what_;
  std::FILE* output_;
  std::function<Clock::time_point()> now_;
  Clock::time_point start_;
  Clock::time_point shown_;
  bool visible_ = false;
};

}  // namespace palpate::cli
