#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "model/touch_evidence.hpp"

namespace palpate {

/// The best fit near a pose that is known only to the grid of Eq. 12, 0.5 mm and 0.04 pi rad, as
/// the particles' mode is. Shifts the object, and turns it about its map's middle, by half a step
/// of the grid and less, as long as the fit improves. Parameters and errors as evidence_fit().
std::optional<Fit> best_fit_near(std::span<const TouchEvidence> touches, const Pose& T_object_robot,
                                 const OccupancyGrid& map, const ContactModel& contact,
                                 std::size_t object);

}  // namespace palpate
