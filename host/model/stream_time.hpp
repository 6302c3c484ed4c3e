#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>

namespace palpate {

/// The host's clock, since the Unix epoch, by which frames are stamped.
inline double host_clock_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

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

/// Largest count that float64, the type in which datasets are read, holds exactly.
inline constexpr std::uint64_t largest_count = std::uint64_t{1} << 53;

/// Adds `more` to a count of lost frames and stops at largest_count: a board or a file may claim
/// any loss.
inline void count_lost(std::uint64_t& count, std::uint64_t more) {
  count = more < largest_count - count ? count + more : largest_count;
}

}  // namespace palpate
