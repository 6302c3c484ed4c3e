#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "palpate/touch_detector.hpp"

namespace palpate {

/// When and where a frame was read.
struct FramePlace {
  double time_s = 0.0;
  std::optional<Pose> T_robot_sensor;
};

/// With fewer frames, a single wrong one would decide.
inline constexpr std::size_t least_frames_of_touch = 3;

/// The touch that frames are: per element the interquartile mean of its pressures, and the mean of
/// the known poses. An element that is known in fewer than three frames is not valid in it.
/// @param frames [n], at least one
/// @param pressure [n, e] above the baseline; NaN: Unknown
/// @param near a pose from which no frame's angle is half a turn away; none: no pose is known
DetectedTouch mean_touch(std::span<const FramePlace> frames, std::span<const double> pressure,
                         const std::optional<Pose>& near);

}  // namespace palpate
