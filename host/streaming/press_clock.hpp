#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "palpate/pose.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// Poses over time, against which presses are held.
struct PoseLog {
  std::span<const double> time_s;        ///< [n] ascending
  std::span<const Pose> T_robot_sensor;  ///< [n] NaN where unknown
  std::span<const double> height_mm;     ///< [n] above the plane of the touches; empty: unknown
  double largest_gap_s = 0.0;            ///< poses further apart are not interpolated
};

/// By how much later the poses' clock reads than that of the frames.
struct ClockOffset {
  double seconds = 0.0;
  std::size_t presses = 0;  ///< that were judged
  std::size_t against = 0;  ///< of these, while the array moves, is lifted, or has no pose
  std::size_t left = 0;     ///< of these, once the clocks agree
  /// An offset by so much more or less explains about as many presses, and the logs, which do not
  /// overlap, tell no more; none: the offset is known.
  std::optional<double> open_s = {};
};

/// The clock's offset as presses show it: the array stands still while it is pressed, and is as low
/// as it gets. Each press is held against the poses at offsets of up to 10 s, or so many more as
/// one log begins or ends before the other; the answer is the middle of the best offsets. Where
/// several lie apart, as where presses come regularly, it is the one next to 0, or, of logs that do
/// not overlap, that next to where they begin together.
/// @param load [m] of frames at `time_s` [m]
/// @param reach_mm of the array, by which turns count as motion
/// @returns none where the best offsets include 0, explain too few presses, or leave many
std::optional<ClockOffset> clock_offset(std::span<const double> time_s, std::span<const float> load,
                                        const PoseLog& poses, double reach_mm);

/// The finding "clock" of such an offset.
/// @param given_s that `pose-delay` has taken from the poses' times
SetupFinding clock_finding(const ClockOffset& offset, double given_s);

}  // namespace palpate
