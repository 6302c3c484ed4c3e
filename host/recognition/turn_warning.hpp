#pragma once

#include <optional>
#include <string>

#include "recognition/recogniser.hpp"
#include "recognition/recognition_record.hpp"
#include "recognition/recognition_task.hpp"

namespace palpate {

/// A warning where the best object looks the same after turns (OccupancyGrid::suggested_symmetry)
/// that its map's symmetry of 1 does not know, and the belief spreads over such turns or a known
/// pose error is such a turn; else none.
std::optional<std::string> turned_alike(const Recogniser& recogniser, const RecognitionTask& task,
                                        const RecognitionStep& step, const GroundTruth& truth);

}  // namespace palpate
