#pragma once

#include <span>
#include <string>
#include <vector>

#include "model/touch_evidence.hpp"
#include "recognition/recognition_record.hpp"
#include "recognition/recognition_task.hpp"

namespace palpate {

/// What looks wrong with an unknown's touches, or else with the lattice on which they were
/// evaluated. Each warning is a sentence that names the evidence and the remedy. Touches that look
/// right and lie well within the region give none.
/// @param touches all touches of the unknown so far
/// @param lattice the task's, about the pivot in use
/// @param step what the filter believes after them; its own warnings are not read
std::vector<std::string> warnings_about(std::span<const TouchEvidence> touches,
                                        const RecognitionTask& task, const PoseLattice& lattice,
                                        const RecognitionStep& step);

}  // namespace palpate
