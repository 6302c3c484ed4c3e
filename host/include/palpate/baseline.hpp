#pragma once

#include <optional>
#include <span>
#include <vector>

#include "palpate/sensor.hpp"

namespace palpate {

/// What an array reads untouched: the median of every element's known readings in these frames (a
/// tare). Dead elements read 0.
/// @param onset pressure that is a touch; a touch that begins or ends among 40 readings or more is
/// found by it. One that lasts all the time is not, nor is any where this is not given.
/// @throws Error (Fault::input) where there is no frame, one of another size or no known reading of
/// an element, or where the array was touched
std::vector<double> baseline_of(std::span<const Frame> frames, const SensorDescription& sensor,
                                std::optional<double> onset);

}  // namespace palpate
