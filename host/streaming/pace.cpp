#include "streaming/pace.hpp"

#include <algorithm>
#include <thread>

namespace palpate {

using Clock = std::chrono::steady_clock;

void Pace::start(double stream_s) {
  last_s_ = stream_s;
  elapsed_s_ = 0.0;
  start_ = Clock::now();
}

bool Pace::wait(double stream_s, std::chrono::milliseconds timeout) {
  if (!speed_) {
    return true;
  }
  const double elapsed_s = elapsed_s_ + std::max(0.0, stream_s - last_s_);
  const std::chrono::duration<double> from_start(elapsed_s / *speed_);
  const std::chrono::duration<double> left = from_start - (Clock::now() - start_);
  if (left > timeout) {
    std::this_thread::sleep_for(timeout);
    return false;
  }
  if (left.count() > 0.0) {
    std::this_thread::sleep_for(left);
  }
  last_s_ = stream_s;
  elapsed_s_ = elapsed_s;
  return true;
}

}  // namespace palpate
