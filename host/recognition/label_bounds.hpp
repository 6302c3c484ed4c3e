#pragma once

#include <optional>
#include <span>
#include <vector>

#include "palpate/estimate.hpp"
#include "recognition/label_probability.hpp"
#include "recognition/recognition_task.hpp"

namespace palpate {

/// The bounds of each label's probability, from the bounds of its hypotheses' log evidence
/// (Certificate::log_evidence). A label is least probable where its own evidence is the lowest and
/// all other evidence the highest. With q of label_probabilities() for the label's evidence E:
///   low = q(E_low) of the label / (q(E_low) of the label + q(E_high) of the others),
/// high likewise. "(none)" has the bounds of its own evidence, or where `known` of
/// label_probabilities() takes its place, that probability.
/// @param estimate with a certificate
/// @param identity [label] of the estimate; lies within its bounds
/// @returns [label], none_label included where the task has it
std::vector<ProbabilityInterval> label_bounds(const Estimate& estimate,
                                              std::span<const double> identity,
                                              const Tempering& tempering,
                                              const RecognitionTask& task,
                                              std::optional<double> known = {});

}  // namespace palpate
