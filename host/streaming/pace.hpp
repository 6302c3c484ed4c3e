#pragma once

#include <chrono>
#include <optional>

namespace palpate {

/// When the frames of a sensor without a board are due. Where the stream's clock was set back, the
/// frame after the step is due at once, and those after it at their distance from it.
class Pace {
 public:
  /// @param speed times as fast as the stream's own time; nothing: at once
  explicit Pace(std::optional<double> speed) : speed_(speed) {}

  /// The stream begins now, at this time of its own.
  void start(double stream_s);
  /// Waits until what has this time is due, at most for `timeout`; false: it is not yet due, and
  /// shall be asked for again.
  bool wait(double stream_s, std::chrono::milliseconds timeout);

 private:
  std::optional<double> speed_;
  double last_s_ = 0.0;     ///< time of the last that was due
  double elapsed_s_ = 0.0;  ///< of the stream, up to it
  std::chrono::steady_clock::time_point start_;
};

}  // namespace palpate
