#pragma once

#include <optional>
#include <span>
#include <vector>

#include "recognition/recognition_record.hpp"
#include "recognition/request.hpp"

namespace palpate {

/// Throws Error where the request selects no touches, or contradicts itself.
void require_selection(const Request& request);

/// The unknowns of one recording: views into its memory. Throws Error where it has fewer touches.
/// @param frames the touches to use, or all
std::vector<Unknown> unknowns_in(const Request& request, const std::optional<Frames>& frames,
                                 const Recording& recording);

/// The unknowns that the request selects: views into the recordings' memory. Throws Error.
std::vector<Unknown> list_unknowns(const Request& request, std::span<const Recording> recordings);

/// The largest reach of any touch's array, which may change from touch to touch; see
/// array_reach_mm().
double largest_reach_mm(std::span<const Touch> touches);
double largest_reach_mm(std::span<const Recording> recordings);

}  // namespace palpate
