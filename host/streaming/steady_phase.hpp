#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "palpate/touch_detector.hpp"

namespace palpate {

/// Consecutive frames of steady load and pose: a candidate for a touch's reading.
class SteadyPhase {
 public:
  explicit SteadyPhase(const TouchDetectorOptions& options) : options_(options) {}

  bool empty() const { return frames_ == 0; }
  /// True where a frame of this load and pose continues the phase.
  bool fits(double load, const std::optional<Pose>& T_robot_sensor) const;
  /// @param pressure [e] above the baseline; NaN: Unknown
  void add(double time_s, double load, const std::vector<double>& pressure,
           const std::optional<Pose>& T_robot_sensor);
  /// Returns the reading; none where the phase is too short. An element known in fewer than three
  /// frames is not valid in it.
  std::optional<DetectedTouch> touch() const;
  /// Forgets all frames.
  void clear();

 private:
  struct Kept {
    double time_s;
    std::optional<Pose> T_robot_sensor;
  };

  std::size_t steady_frames() const;
  void thin();

  TouchDetectorOptions options_;
  std::size_t frames_ = 0;
  double load_sum_ = 0.0;
  std::optional<Pose> first_pose_;
  std::size_t stride_ = 1;  ///< one of this many frames is kept
  std::vector<Kept> kept_;
  std::vector<double> pressure_;  ///< [kept, e]
};

}  // namespace palpate
