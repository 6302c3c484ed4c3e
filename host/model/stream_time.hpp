#pragma once

#include <algorithm>
#include <optional>

namespace palpate {

/// Measures how long a stream has run by the host times of its frames. Where the host's clock is
/// set back, no time is added, so that nothing waits for the clock to catch up. A clock set forward
/// looks like a pause of the board, and its step is added.
class StreamTime {
 public:
  /// Takes the time of the next frame; returns the seconds since the first frame.
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
