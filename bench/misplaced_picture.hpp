#pragma once

#include <string>
#include <vector>

#include "palpate/pose_histogram.hpp"

namespace palpate::bench {

/// Draws the belief about one unknown, touched five times at places 1 mm and 0.05 rad (standard
/// deviations) beside the reported ones: as if touches were exact, and averaged over where they may
/// have been. Each panel shows the belief over position, the true place, and the refined pose with
/// the ellipse that holds it up to two standard deviations. Returns the bytes of a PNG file.
/// @throws Error if the device or Cairo fails
std::string draw_misplaced_unknown(Device& device, const std::vector<Hypothesis>& letters);

}  // namespace palpate::bench
