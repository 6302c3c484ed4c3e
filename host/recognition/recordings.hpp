#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "palpate/contact.hpp"
#include "palpate/touch.hpp"
#include "recognition/request.hpp"

namespace palpate {

/// Reads recordings of touches. Throws Error on a raw stream, on a file given twice, and on
/// recordings of different pressure units.
std::vector<Recording> read_touch_recordings(const std::vector<std::string>& paths);

/// Throws Error where a recording is a raw stream, or its pressure unit is not that of the first.
void require_touches(const Recording& recording, const Recording& first);

/// The selected touches of a recording, or all. Throws Error where it has fewer.
Frames selected_touches(const Recording& recording, const std::optional<Frames>& frames);

/// The classifier of Eq. 3 for pressures of this unit: raw ones have no default threshold. `source`
/// is named where it is missing.
ContactClassifier make_classifier(const std::string& pressure_unit, const std::string& source,
                                  std::optional<double> threshold, std::optional<double> ratio);

}  // namespace palpate
