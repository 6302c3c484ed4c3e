#pragma once

#include <optional>
#include <span>

#include "palpate/device.hpp"
#include "palpate/fit.hpp"
#include "palpate/map_builder.hpp"

namespace palpate {

/// Mean and standard deviation of numbers z of one object; none where they do not differ.
std::optional<FitScale> scale_of(std::span<const double> z);

/// MapSource::left_out. Builds maps of random three quarters of the touches, and judges the others
/// at their poses, until about 200 are judged, or each touch once.
/// @returns none where fewer than 16 touches are in contact
/// @throws Error as MapBuilder does
std::optional<FitScale> left_out_fit(Device& device, const MapSource& source);

}  // namespace palpate
