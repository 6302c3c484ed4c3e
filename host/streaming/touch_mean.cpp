#include "streaming/touch_mean.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace palpate {

namespace {

// Returns the mean of the middle half; values at its borders count in part. Reorders the values. It
// averages Gaussian noise with 84 % of the mean's efficiency (the median: 64 %) and, unlike the
// median, resolves less than a step of the sensor's converter.
double interquartile_mean(std::span<double> values) {
  std::sort(values.begin(), values.end());
  const double n = static_cast<double>(values.size());
  double sum = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double rank = static_cast<double>(i);
    const double part = std::min(rank + 1.0, 0.75 * n) - std::max(rank, 0.25 * n);
    sum += std::max(part, 0.0) * values[i];
  }
  return sum / (0.5 * n);
}

}  // namespace

DetectedTouch mean_touch(std::span<const FramePlace> frames, std::span<const double> pressure,
                         const std::optional<Pose>& near) {
  const std::size_t n = frames.size();
  const std::size_t e = pressure.size() / n;
  DetectedTouch touch{.begin_s = frames.front().time_s,
                      .end_s = frames.back().time_s,
                      .frames = n,
                      .pressure = std::vector<double>(e, 0.0),
                      .valid = std::vector<std::uint8_t>(e, 0)};
  std::vector<double> values(n);
  for (std::size_t k = 0; k < e; ++k) {
    std::size_t known = 0;
    for (std::size_t i = 0; i < n; ++i) {
      if (const double value = pressure[i * e + k]; !std::isnan(value)) {
        values[known++] = value;
      }
    }
    if (known >= least_frames_of_touch) {
      touch.pressure[k] = interquartile_mean(std::span(values).first(known));
      touch.valid[k] = 1;
    }
  }
  Pose sum;
  double poses = 0.0;
  for (const FramePlace& frame : frames) {
    if (const auto& pose = frame.T_robot_sensor) {
      sum.translation_mm += pose->translation_mm;
      sum.theta_rad += wrap_angle(pose->theta_rad - near->theta_rad);
      poses += 1.0;
    }
  }
  if (poses > 0.0) {
    touch.T_robot_sensor =
        Pose{sum.translation_mm / poses, near->theta_rad + sum.theta_rad / poses};
  }
  return touch;
}

}  // namespace palpate
