#pragma once

#include "figures/figures.hpp"
#include "recognition/recognition_record.hpp"

namespace palpate::cli {

/// Where one object's belief lies; a single empty cell where it has none.
PlacedBelief belief_of(const Recogniser& recogniser, int object);

/// The picture of one recognised unknown: its result in words, its touches, its trace.
/// @param belief of the object of the last step's mode
RecognitionSheet sheet_of(const RecognitionRecord& record, const Query& unknown,
                          const RecognitionTask& task, PlacedBelief belief);

}  // namespace palpate::cli
