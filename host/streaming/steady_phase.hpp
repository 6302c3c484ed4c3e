#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "palpate/touch_detector.hpp"

namespace palpate {

/// Frames in a row that are alike: the candidate for a touch's reading.
class SteadyPhase {
 public:
  explicit SteadyPhase(const TouchDetectorOptions& options) : options_(options) {}

  bool empty() const { return frames_ == 0; }
  /// Whether a frame of this load and pose is like those before it.
  bool fits(double load, const std::optional<Pose>& T_robot_sensor) const;
  /// @param pressure [e] above the baseline; NaN: Unknown
  void add(double time_s, double load, const std::vector<double>& pressure,
           const std::optional<Pose>& T_robot_sensor);
  /// The reading, unless the phase is too short. An element that was known in fewer than three of
  /// its frames is not valid in it.
  std::optional<DetectedTouch> touch() const;
  /// Forgets its frames.
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
  std::size_t stride_ = 1;  ///< every how many frames one is kept
  std::vector<Kept> kept_;
  std::vector<double> pressure_;  ///< [kept, e]
};

}  // namespace palpate
