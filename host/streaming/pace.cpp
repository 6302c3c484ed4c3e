#include "pace.hpp"

#include <thread>

namespace palpate {

using Clock = std::chrono::steady_clock;

void Pace::start(double stream_s) {
  first_s_ = stream_s;
  start_ = Clock::now();
}

bool Pace::wait(double stream_s, std::chrono::milliseconds timeout) const {
  if (!speed_) {
    return true;
  }
  const std::chrono::duration<double> from_start((stream_s - first_s_) / *speed_);
  const std::chrono::duration<double> left = from_start - (Clock::now() - start_);
  if (left > timeout) {
    std::this_thread::sleep_for(timeout);
    return false;
  }
  if (left.count() > 0.0) {
    std::this_thread::sleep_for(left);
  }
  return true;
}

}  // namespace palpate
