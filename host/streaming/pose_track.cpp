#include "palpate/pose_track.hpp"

#include <algorithm>
#include <cmath>

#include "streaming/pose_between.hpp"

namespace palpate {

namespace {

// Poses in a row that show a set clock; fewer may be stamped wrongly.
constexpr std::size_t enough_to_join = 3;
// A pose that comes this many largest gaps later may be stamped wrongly.
constexpr double gaps_of_a_leap = 10.0;

}  // namespace

bool is_robot_pose(const Pose& T_robot_sensor) {
  constexpr double largest = 1e9;
  return std::abs(T_robot_sensor.translation_mm.x) <= largest &&
         std::abs(T_robot_sensor.translation_mm.y) <= largest &&
         std::abs(T_robot_sensor.theta_rad) <= largest;
}

bool PoseTrack::add(double time_s, const Pose& T_robot_sensor) {
  if (!std::isfinite(time_s) || !is_robot_pose(T_robot_sensor)) {
    ++dropped_;
    return false;
  }
  const std::optional<double> last = last_s();
  const double leap_s = gaps_of_a_leap * largest_gap_s_;
  if (!last || (time_s > *last && time_s - *last <= leap_s)) {
    drop_aside();
    poses_.emplace_back(time_s, T_robot_sensor);
    return true;
  }
  const bool in_order = !aside_.empty() && time_s > aside_.back().first;
  const bool same_side = !aside_.empty() && (time_s > *last) == (aside_.front().first > *last);
  if (!in_order || !same_side) {
    drop_aside();
  }
  aside_.emplace_back(time_s, T_robot_sensor);
  if (aside_.size() < enough_to_join) {
    return false;
  }
  join();
  return true;
}

void PoseTrack::end() {
  if (!aside_.empty() && aside_.front().first > poses_.back().first) {
    join();
  }
  drop_aside();
}

void PoseTrack::join() {
  const double begin_s = aside_.front().first;
  set_back_ += begin_s <= poses_.back().first ? 1 : 0;
  while (!poses_.empty() && poses_.back().first >= begin_s) {
    poses_.pop_back();
  }
  poses_.insert(poses_.end(), aside_.begin(), aside_.end());
  aside_.clear();
}

void PoseTrack::drop_aside() {
  dropped_ += aside_.size();
  aside_.clear();
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
  return between(earlier, later, part);
}

std::optional<double> PoseTrack::last_s() const {
  return poses_.empty() ? std::nullopt : std::optional(poses_.back().first);
}

void PoseTrack::forget_before(double time_s) {
  // Interpolation at this time needs the last pose before it.
  while (poses_.size() > 1 && poses_[1].first <= time_s) {
    poses_.pop_front();
  }
}

}  // namespace palpate
