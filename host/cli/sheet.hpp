#pragma once

#include <span>

#include "figures/figures.hpp"
#include "recognition/recognition_record.hpp"

namespace palpate::cli {

/// Edge of the squares that stand for elements, mm: 90 % of the pitch, at most 1.8 mm.
double element_edge_mm(std::span<const glm::dvec2> elements_mm);

/// Where one object's belief lies; a single empty cell where it has none.
PlacedBelief belief_of(const Recogniser& recogniser, int object);

/// The picture of one recognised unknown: its result in words, its touches, its trace.
/// @param belief of the object of the last step's mode
RecognitionSheet sheet_of(const RecognitionRecord& record, const Query& unknown,
                          const RecognitionTask& task, PlacedBelief belief);

}  // namespace palpate::cli
