#pragma once

#include <optional>
#include <span>
#include <string>

#include "model/touch_evidence.hpp"
#include "recognition/recognition_task.hpp"

namespace palpate {

// Rules about the touches of an unknown. Each rule returns a warning (see warnings_about()), or
// none where the touches look right. There is at least one touch.

/// The sensor's positions look like metres.
std::optional<std::string> positions_in_metres(std::span<const TouchEvidence> touches);
/// The sensor's angles look like degrees.
std::optional<std::string> angles_in_degrees(std::span<const TouchEvidence> touches);
/// The array and a map have scales that do not fit together.
std::optional<std::string> other_scale(std::span<const TouchEvidence> touches,
                                       const RecognitionTask& task);
/// The threshold leaves no element known, or the touches tell nothing, since no element was ever in
/// contact or all were.
std::optional<std::string> nothing_felt(std::span<const TouchEvidence> touches, double threshold);
/// No pose of the region brings most of the touches that have an element In Contact to any map.
std::optional<std::string> out_of_reach(std::span<const TouchEvidence> touches,
                                        const RecognitionTask& task, const PoseLattice& region);

}  // namespace palpate
