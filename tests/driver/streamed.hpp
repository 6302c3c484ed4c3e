#pragma once

#include <chrono>
#include <functional>
#include <thread>
#include <vector>

#include "palpate/sensor.hpp"

namespace palpate {

/// Longest wait, which only a failing test reaches, even on a busy machine.
constexpr std::chrono::seconds patience{20};

/// Waits until the condition holds. Returns false if it does not hold in time.
inline bool becomes_true(const std::function<bool()>& condition) {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) {
      return false;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

/// The next `count` frames, or fewer if fewer come.
inline std::vector<Frame> take(Sensor& sensor, std::size_t count) {
  std::vector<Frame> frames;
  while (frames.size() < count) {
    std::optional<Frame> frame = sensor.next(patience);
    if (!frame) {
      break;
    }
    frames.push_back(std::move(*frame));
  }
  return frames;
}

}  // namespace palpate
