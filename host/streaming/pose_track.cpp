#include "palpate/pose_track.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate {

bool PoseTrack::add(double time_s, const Pose& T_robot_sensor) {
  if (!poses_.empty() && time_s <= poses_.back().first) {
    return false;
  }
  poses_.emplace_back(time_s, T_robot_sensor);
  return true;
}

std::optional<Pose> PoseTrack::at(double time_s) const {
  const auto after =
      std::lower_bound(poses_.begin(), poses_.end(), time_s,
                       [](const auto& pose, double time) { return pose.first < time; });
  if (after == poses_.end()) {
    return {};
  }
  const auto& [later_s, later] = *after;
  if (later_s == time_s) {
    return later;
  }
  if (after == poses_.begin()) {
    return {};
  }
  const auto& [earlier_s, earlier] = *std::prev(after);
  if (later_s - earlier_s > largest_gap_s_) {
    return {};
  }
  const double part = (time_s - earlier_s) / (later_s - earlier_s);
  constexpr double turn_rad = 2.0 * std::numbers::pi;
  const Pose pose{
      earlier.translation_mm + part * (later.translation_mm - earlier.translation_mm),
      earlier.theta_rad + part * wrap_angle(later.theta_rad - earlier.theta_rad, turn_rad)};
  // The difference of two numbers of 1e308 is none.
  const bool finite = std::isfinite(pose.translation_mm.x) &&
                      std::isfinite(pose.translation_mm.y) && std::isfinite(pose.theta_rad);
  return finite ? std::optional(pose) : std::nullopt;
}

std::optional<double> PoseTrack::last_s() const {
  return poses_.empty() ? std::nullopt : std::optional(poses_.back().first);
}

void PoseTrack::forget_before(double time_s) {
  // The last pose before this time is needed for the time itself.
  while (poses_.size() > 1 && poses_[1].first <= time_s) {
    poses_.pop_front();
  }
}

}  // namespace palpate
