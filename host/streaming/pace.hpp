#pragma once

#include <chrono>
#include <optional>

namespace palpate {

/// Paces the frames of a sensor without a board by the stream's own times. Where these step back,
/// the next frame is due at once, and later frames at their distance from it.
class Pace {
 public:
  /// @param speed multiple of the stream's own time; none: every frame is due at once
  explicit Pace(std::optional<double> speed) : speed_(speed) {}

  /// Starts the stream now, at `stream_s` of its own time.
  void start(double stream_s);
  /// Waits until a frame of time `stream_s` is due, at most for `timeout`. Returns false where it
  /// is not yet due: ask again.
  bool wait(double stream_s, std::chrono::milliseconds timeout);

 private:
  std::optional<double> speed_;
  double last_s_ = 0.0;     ///< time of the last frame that was due
  double elapsed_s_ = 0.0;  ///< stream time up to that frame
  std::chrono::steady_clock::time_point start_;
};

}  // namespace palpate
