#pragma once

#include "figures.hpp"
#include "recognition_record.hpp"

namespace palpate::cli {

/// The picture of one recognised unknown: its result in words, its touches, its trace.
/// @param belief of the object of the last step's mode
RecognitionSheet sheet_of(const RecognitionRecord& record, const Unknown& unknown,
                          const RecognitionTask& task, Marginals belief);

}  // namespace palpate::cli
