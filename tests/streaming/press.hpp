#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/touch_detector.hpp"

namespace palpate {

/// Reading of a whole array by time.
using Pressures = std::function<std::vector<double>(double time_s)>;

/// How far a press has gone at a time: 0 before `begin_s`, 1 from 0.1 s later on for `steady_s`,
/// then back in another 0.1 s.
inline double press(double time_s, double begin_s, double steady_s) {
  constexpr double ramp_s = 0.1;
  const double into = (time_s - begin_s) / ramp_s;
  const double out = (begin_s + 2.0 * ramp_s + steady_s - time_s) / ramp_s;
  return std::clamp(std::min(into, out), 0.0, 1.0);
}

/// The pattern pressed every second from 0.3 s on, for 0.4 s each.
inline Pressures presses_of(const std::vector<double>& pattern) {
  return [pattern](double time_s) {
    std::vector<double> values = pattern;
    for (double& value : values) {
      value *= press(std::fmod(time_s, 1.0), 0.3, 0.4);
    }
    return values;
  };
}

inline constexpr double stream_begin_s = 1.7e9;

/// A stream of frames with Gaussian noise, from 1.7e9 s on.
struct PressStream {
  double rate_hz = 100.0;
  double noise = 0.3;

  std::vector<Frame> frames(double seconds, const Pressures& pressures) const {
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal(0.0, 1.0);
    std::vector<Frame> frames;
    const auto count = static_cast<std::size_t>(seconds * rate_hz);
    for (std::size_t i = 0; i < count; ++i) {
      const double time_s = static_cast<double>(i) / rate_hz;
      Frame frame{.host_time_s = stream_begin_s + time_s, .values = pressures(time_s)};
      for (double& value : frame.values) {
        value += noise * normal(random);
      }
      frames.push_back(std::move(frame));
    }
    return frames;
  }
};

/// The touches in a stream, and the one that is not over at its end.
inline std::vector<DetectedTouch> touches_in(const std::vector<Frame>& frames,
                                             const TouchDetectorOptions& options = {},
                                             const std::vector<double>& baseline = {},
                                             const std::vector<std::uint8_t>& valid = {}) {
  TouchDetector detector(options, baseline, valid);
  std::vector<DetectedTouch> touches;
  for (const Frame& frame : frames) {
    if (auto touch = detector.add(frame)) {
      touches.push_back(std::move(*touch));
    }
  }
  if (auto touch = detector.finish()) {
    touches.push_back(std::move(*touch));
  }
  return touches;
}

/// Expects the same touches, their pressure times `scale`.
inline void expect_same(std::span<const DetectedTouch> touches,
                        std::span<const DetectedTouch> expected, double scale = 1.0) {
  ASSERT_EQ(touches.size(), expected.size());
  for (std::size_t i = 0; i < touches.size(); ++i) {
    SCOPED_TRACE(i);
    std::vector<double> pressure = expected[i].pressure;
    std::ranges::for_each(pressure, [&](double& value) { value *= scale; });
    EXPECT_EQ(touches[i].pressure, pressure);
    EXPECT_EQ(touches[i].begin_s, expected[i].begin_s);
    EXPECT_EQ(touches[i].end_s, expected[i].end_s);
    EXPECT_EQ(touches[i].frames, expected[i].frames);
    EXPECT_EQ(touches[i].valid, expected[i].valid);
  }
}

}  // namespace palpate
