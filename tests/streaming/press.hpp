#pragma once

#include <functional>
#include <random>
#include <span>
#include <vector>

#include "palpate/touch_detector.hpp"

namespace palpate {

/// Reading of a whole array by time.
using Pressures = std::function<std::vector<double>(double time_s)>;

/// How far a press has gone at a time: 0 before `begin_s`, 1 from 0.1 s later on for `steady_s`,
/// then back in another 0.1 s.
double press(double time_s, double begin_s, double steady_s);

/// The pattern pressed every second from 0.3 s on, for 0.4 s each.
Pressures presses_of(const std::vector<double>& pattern);

/// A stream of frames with Gaussian noise, from 1.7e9 s on.
struct PressStream {
  double rate_hz = 100.0;
  double noise = 0.3;

  std::vector<Frame> frames(double seconds, const Pressures& pressures) const;
};

inline constexpr double stream_begin_s = 1.7e9;

/// The touches in a stream, and the one that is not over at its end.
std::vector<DetectedTouch> touches_in(const std::vector<Frame>& frames,
                                      const TouchDetectorOptions& options = {},
                                      const std::vector<double>& baseline = {},
                                      const std::vector<std::uint8_t>& valid = {});

/// Expects the same touches, their pressure times `scale`.
void expect_same(std::span<const DetectedTouch> touches, std::span<const DetectedTouch> expected,
                 double scale = 1.0);

}  // namespace palpate
