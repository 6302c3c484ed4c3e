#pragma once

#include <string>
#include <vector>

#include "io/recording_survey.hpp"

namespace palpate {

/// Returns what is probably wrong with a recording: units, elements that do not work, poses and
/// times. Each item is one sentence of text that names the fault and mostly its remedy. The rules
/// rather miss a fault than suspect a sound recording: a simulated recording gives no sentence,
/// with or without noise, as soon as it touches its object.
std::vector<std::string> suspicions_of(const RecordingSurvey& survey);

}  // namespace palpate
