#pragma once

#include <chrono>
#include <optional>

namespace palpate {

/// When the frames of a sensor without a board are due.
class Pace {
 public:
  /// @param speed times as fast as the stream's own time; nothing: at once
  explicit Pace(std::optional<double> speed) : speed_(speed) {}

  /// The stream begins now, at this time of its own.
  void start(double stream_s);
  /// Waits until what has this time is due, at most for `timeout`; false: it is not yet due.
  bool wait(double stream_s, std::chrono::milliseconds timeout) const;

 private:
  std::optional<double> speed_;
  double first_s_ = 0.0;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace palpate
