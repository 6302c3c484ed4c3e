#pragma once

#include <optional>
#include <span>
#include <vector>

#include "palpate/sensor.hpp"

namespace palpate {

/// What an array reads untouched: the median of every element over these frames (a tare). Dead
/// elements read 0.
/// @param onset pressure that is a touch; a touch that begins or ends among 40 frames or more is
/// found by it. One that lasts all the time is not, nor is any where this is not given.
/// @throws Error (Fault::input) where there is no frame or the array was touched
std::vector<double> baseline_of(std::span<const Frame> frames, const SensorDescription& sensor,
                                std::optional<double> onset);

}  // namespace palpate
