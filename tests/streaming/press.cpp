#include "press.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace palpate {

double press(double time_s, double begin_s, double steady_s) {
  constexpr double ramp_s = 0.1;
  const double into = (time_s - begin_s) / ramp_s;
  const double out = (begin_s + 2.0 * ramp_s + steady_s - time_s) / ramp_s;
  return std::clamp(std::min(into, out), 0.0, 1.0);
}

Pressures presses_of(const std::vector<double>& pattern) {
  return [pattern](double time_s) {
    std::vector<double> values = pattern;
    for (double& value : values) {
      value *= press(std::fmod(time_s, 1.0), 0.3, 0.4);
    }
    return values;
  };
}

std::vector<Frame> PressStream::frames(double seconds, const Pressures& pressures) const {
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

std::vector<DetectedTouch> touches_in(const std::vector<Frame>& frames,
                                      const TouchDetectorOptions& options,
                                      const std::vector<double>& baseline,
                                      const std::vector<std::uint8_t>& valid) {
  TouchDetector detector(options, baseline, valid);
  std::vector<DetectedTouch> touches;
  const auto take = [&](std::optional<DetectedTouch> touch) {
    if (touch) {
      touches.push_back(std::move(*touch));
    }
  };
  for (const Frame& frame : frames) {
    take(detector.add(frame));
  }
  take(detector.finish());
  return touches;
}

void expect_same(std::span<const DetectedTouch> touches, std::span<const DetectedTouch> expected,
                 double scale) {
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
