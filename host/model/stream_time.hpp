#pragma once

#include <algorithm>
#include <optional>

namespace palpate {

/// How long a stream of frames has run by their host times. The host's clock may be set meanwhile:
/// a step back counts as no time, so that nothing waits until the clock has caught up; a step
/// forward cannot be told from a pause of the board and counts.
class StreamTime {
 public:
  /// To be called with the time of every frame, in order; returns the seconds since the first.
  double advance(double host_time_s) {
    elapsed_s_ += std::max(0.0, host_time_s - last_s_.value_or(host_time_s));
    last_s_ = host_time_s;
    return elapsed_s_;
  }

  double elapsed_s() const { return elapsed_s_; }

 private:
  std::optional<double> last_s_;
  double elapsed_s_ = 0.0;
};

}  // namespace palpate
