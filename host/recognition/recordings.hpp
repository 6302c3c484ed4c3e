#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "palpate/contact.hpp"
#include "palpate/touch.hpp"
#include "recognition/recognition_record.hpp"
#include "recognition/request.hpp"

namespace palpate {

/// Reads recordings of touches. Throws Error on a raw stream, on a file given twice, and on
/// recordings of different pressure units.
std::vector<Recording> read_touch_recordings(const std::vector<std::string>& paths);

/// Throws Error where a recording is a raw stream, or its pressure unit is not that of the first.
void require_touches(const Recording& recording, const Recording& first);

/// The selected touches of a recording, or all. Throws Error where it has fewer.
Frames selected_touches(const Recording& recording, const std::optional<Frames>& frames);

/// The classifier of Eq. 3 for pressures of this unit, by options that are sound: raw pressures
/// have no default threshold. `source` is named where it is missing.
ContactClassifier make_classifier(const std::string& pressure_unit, const std::string& source,
                                  std::optional<double> threshold, std::optional<double> ratio);

/// Throws Error where the request selects no touches, or contradicts itself.
void require_selection(const Request& request);

/// The unknowns of one recording: views into its memory. Throws Error where it has fewer touches.
/// @param frames the touches to use, or all
std::vector<Query> unknowns_in(const Request& request, const std::optional<Frames>& frames,
                               const Recording& recording);

/// The unknowns that the request selects: views into the recordings' memory. Throws Error.
std::vector<Query> list_unknowns(const Request& request, std::span<const Recording> recordings);

/// The largest reach of any touch's array, which may change from touch to touch; see
/// array_reach_mm().
double largest_reach_mm(std::span<const Recording> recordings);

}  // namespace palpate
