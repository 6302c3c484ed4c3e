#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "palpate/pose.hpp"

namespace palpate {

/// Something that is wrong with the set-up of a robot and its array.
struct SetupFinding {
  /// "pose_unit", "element_order", "array_offset", "pitch", "dead_elements", "stuck_elements",
  /// "contradicting", "unexplained", as touches say; "tilt", "clock" or "dropped", as logs do.
  std::string what;
  /// By how much more likely the touches are once it is mended; of "clock", log 19 for each press
  /// that it explains; 0 of "unexplained", "tilt" and "dropped", which are counted.
  double nats = 0.0;
  std::string words;                      ///< a sentence, options between `quotes`
  std::vector<std::string> options = {};  ///< that mend it together, such as "dead 13,42"
  /// Pose of the recordings' array in the true sensor frame, to be applied to the elements, with
  /// its standard deviations in mm, mm and rad.
  std::optional<Pose> array_offset = {};
  std::optional<std::array<double, 3>> sd = {};
};

}  // namespace palpate
