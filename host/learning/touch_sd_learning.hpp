#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "learning/press.hpp"
#include "palpate/device.hpp"
#include "palpate/learned_sensor.hpp"
#include "palpate/map_builder.hpp"
#include "recognition/touch_sd_fit.hpp"

namespace palpate {

/// Standard deviations of the poses of touches about those that the robot reported, by
/// fit_touch_sd(), and 0 where they lie below the fit's resolution or twice its standard error: a
/// fifth of each object's touches, some at a time, is compared with maps of the others, by Eq. 7
/// with the sensor's classifier. The maps are of displaced touches, too: their edges are blurred,
/// which the fit learns as what elements read there.
/// @param presses at known poses, of one touch each
/// @param progress called now and then with the fraction done
/// @returns none where that makes fewer than five unknowns of at least five touches: too few to
/// tell
/// @throws Error as fit_touch_sd() and observed_map(); what `progress` throws
std::optional<DisplacementSd> learn_touch_sd(Device& device, const std::vector<Press>& presses,
                                             const LearnedSensor& sensor, const MapOptions& maps,
                                             const std::function<void(double)>& progress = {});

}  // namespace palpate
