#pragma once

#include <functional>
#include <string>

#include "palpate/occupancy_grid.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// Whether a point of the object frame, in mm, lies on the object.
using Silhouette = std::function<bool(const glm::dvec2&)>;

/// The letter L, 16 mm high and 10 mm wide with strokes of 4 mm, of no symmetry.
bool on_letter_l(const glm::dvec2& p_mm);
/// A disc of 7 mm radius.
bool on_disc(const glm::dvec2& p_mm);

/// What a map of the shape would be: log odds of 3 on it and of -3 elsewhere, cells of 0.5 mm over
/// [-14, 14]^2 mm.
OccupancyGrid map_of(const Silhouette& shape, const std::string& label);

/// Touches by the DigiTacts array, at random poses that meet the object, each element reading the
/// shape below its centre without error.
Recording touches_of(const Silhouette& shape, const Pose& T_object_robot, std::size_t touches,
                     std::uint64_t seed);

}  // namespace palpate
