#include "streaming/steady_phase.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include <glm/geometric.hpp>

namespace palpate {

namespace {

constexpr double turn_rad = 2.0 * std::numbers::pi;
// Beyond this many frames, the sensor's own error exceeds the mean's noise.
constexpr std::size_t most_kept = 512;
// With fewer frames, a single wrong one would decide.
constexpr std::size_t least_frames = 3;

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

bool SteadyPhase::fits(double load, const std::optional<Pose>& T_robot_sensor) const {
  if (empty()) {
    return true;
  }
  const double mean = load_sum_ / static_cast<double>(frames_);
  // In a light touch, noise is a large part of the load and no sign of change.
  if (std::abs(load - mean) > std::max(options_.steady * mean, options_.release)) {
    return false;
  }
  if (!T_robot_sensor || !first_pose_) {
    return true;
  }
  return glm::distance(T_robot_sensor->translation_mm, first_pose_->translation_mm) <
             options_.steady_mm &&
         std::abs(wrap_angle(T_robot_sensor->theta_rad - first_pose_->theta_rad, turn_rad)) <
             options_.steady_rad;
}

void SteadyPhase::add(double time_s, double load, const std::vector<double>& pressure,
                      const std::optional<Pose>& T_robot_sensor) {
  load_sum_ += load;
  if (!first_pose_) {
    first_pose_ = T_robot_sensor;
  }
  if (frames_++ % stride_ != 0) {
    return;
  }
  kept_.push_back({time_s, T_robot_sensor});
  pressure_.insert(pressure_.end(), pressure.begin(), pressure.end());
  if (kept_.size() == most_kept) {
    thin();
  }
}

// Drops every second frame kept, and keeps half as many from here on.
void SteadyPhase::thin() {
  const std::size_t e = pressure_.size() / kept_.size();
  for (std::size_t i = 0; 2 * i < kept_.size(); ++i) {
    kept_[i] = kept_[2 * i];
    std::copy_n(pressure_.begin() + static_cast<std::ptrdiff_t>(2 * i * e), e,
                pressure_.begin() + static_cast<std::ptrdiff_t>(i * e));
  }
  kept_.resize(most_kept / 2);
  pressure_.resize(kept_.size() * e);
  stride_ *= 2;
}

// Counts the frames kept before the release, which shows late in the smoothed pressures.
std::size_t SteadyPhase::steady_frames() const {
  constexpr std::size_t median_delay = 2;
  if (kept_.size() < median_delay) {
    return 0;
  }
  std::size_t n = kept_.size() - median_delay;
  while (n > 0 && kept_[n - 1].time_s > kept_.back().time_s - options_.smooth_s) {
    --n;
  }
  return n;
}

std::optional<DetectedTouch> SteadyPhase::touch() const {
  const std::size_t n = steady_frames();
  if (n < least_frames || kept_[n - 1].time_s - kept_[0].time_s < options_.min_steady_s) {
    return {};
  }
  const std::size_t e = pressure_.size() / kept_.size();
  DetectedTouch touch{.begin_s = kept_[0].time_s,
                      .end_s = kept_[n - 1].time_s,
                      .frames = n,
                      .pressure = std::vector<double>(e, 0.0),
                      .valid = std::vector<std::uint8_t>(e, 0)};
  std::vector<double> values(n);
  for (std::size_t k = 0; k < e; ++k) {
    std::size_t known = 0;
    for (std::size_t i = 0; i < n; ++i) {
      if (const double value = pressure_[i * e + k]; !std::isnan(value)) {
        values[known++] = value;
      }
    }
    if (known >= least_frames) {
      touch.pressure[k] = interquartile_mean(std::span(values).first(known));
      touch.valid[k] = 1;
    }
  }
  Pose sum;
  double poses = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    if (const auto& pose = kept_[i].T_robot_sensor) {
      sum.translation_mm += pose->translation_mm;
      sum.theta_rad += wrap_angle(pose->theta_rad - first_pose_->theta_rad, turn_rad);
      poses += 1.0;
    }
  }
  if (poses > 0.0) {
    touch.T_robot_sensor =
        Pose{sum.translation_mm / poses, first_pose_->theta_rad + sum.theta_rad / poses};
  }
  return touch;
}

void SteadyPhase::clear() {
  frames_ = 0;
  load_sum_ = 0.0;
  first_pose_.reset();
  stride_ = 1;
  kept_.clear();
  pressure_.clear();
}

}  // namespace palpate
