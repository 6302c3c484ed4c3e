#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

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

/// Cuts a stroke, a press during which the array slides, into touches.
///
/// The stroke is divided where the array has moved by so many millimetres from the last division. A
/// part becomes a touch where the array moves steadily in it: its halves take times that differ by
/// less than a factor of two. The touch is the mean of the frames within a quarter of a millimetre
/// of the middle, or of the three nearest: pressures of a longer way would be blurred.
class StrokeTouches {
 public:
  /// @param every_mm distance of the touches, above 0
  /// @param valid empty or [e]; 0 = dead element
  StrokeTouches(double every_mm, std::vector<std::uint8_t> valid);

  /// Takes the next frame of a press, its values above the rest. Frames without a pose are left
  /// out.
  void add(const Frame& frame);
  /// Ends the press; returns its touches, none where the array did not move so far.
  std::vector<DetectedTouch> finish();

 private:
  void end_part();
  bool is_steady(std::size_t middle) const;

  double every_mm_;
  std::vector<std::uint8_t> valid_;
  std::vector<FramePlace> part_;  ///< frames since the last division
  std::vector<double> pressure_;  ///< [part, e]; NaN: Unknown
  std::vector<DetectedTouch> touches_;
};

}  // namespace palpate
