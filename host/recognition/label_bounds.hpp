#pragma once

#include <span>
#include <vector>

#include "palpate/estimate.hpp"
#include "recognition_task.hpp"

namespace palpate {

/// The bounds of each label's probability, from the bounds of its hypotheses' log evidence
/// (Certificate::log_evidence). A label is least probable where its own evidence is the lowest and
/// all other evidence the highest:
///   low = E_low(label) / (E_low(label) + E_high(others) + E(none)), high likewise.
/// The evidence of "(none)" is taken as the estimate gives it.
/// @param estimate with a certificate
/// @param identity [label] of the estimate; lies within its bounds
/// @returns [label], none_label included where the task has it
std::vector<ProbabilityInterval> label_bounds(const Estimate& estimate,
                                              std::span<const double> identity,
                                              const RecognitionTask& task);

}  // namespace palpate
