#pragma once

#include <chrono>
#include <string>

namespace palpate::cli {

/// A progress line on standard error, for work over two seconds and only when it is a terminal.
class Progress {
 public:
  explicit Progress(std::string what) : what_(std::move(what)) {}
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Shows the fraction done, in [0, 1].
  void show(double fraction);

 private:
  std::string what_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point shown_ = start_;
  bool visible_ = false;
};

}  // namespace palpate::cli
