#pragma once

#include <optional>
#include <span>
#include <vector>

#include "palpate/api.hpp"
#include "palpate/sensor.hpp"

namespace palpate {

/// Takes a tare: returns what the untouched array reads, [e] in the sensor's pressure unit, as the
/// median of each element's known readings (see is_known()) over the frames; 0 for a dead element.
/// @param onset if given, the array counts as touched where the medians over the four quarters of
/// an element's readings differ by more than `onset`. This check needs 40 known readings, and
/// misses a touch that lasts through all frames.
/// @throws Error (Fault::input) on no frame, a frame of another size, an element without a known
/// reading, or a touched array
PALPATE_API std::vector<double> baseline_of(std::span<const Frame> frames,
                                            const SensorDescription& sensor,
                                            std::optional<double> onset);

}  // namespace palpate
