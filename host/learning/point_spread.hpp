#pragma once

#include <optional>
#include <vector>

#include "learning/press.hpp"
#include "palpate/contact.hpp"

namespace palpate {

/// Standard deviation of the sensor's point spread in mm, from touches at known poses.
///
/// Takes every object for a flat face at one height. The face lies where the mean pressure, each
/// touch relative to its force, exceeds half of its plateau. Blurred by a Gaussian and averaged
/// over elements (squares of 0.95 element spacings), the face explains the pressures up to each
/// touch's force with a least squared error, whose place is the result. Edges that are rounded or
/// sloped count as blur.
/// @param presses at known poses
/// @returns none where the touches do not determine it: too few, or the least error lies at the end
/// of what is searched, a twentieth to three times the element spacing
std::optional<double> learn_point_spread(const std::vector<Press>& presses,
                                         const ContactClassifier& classifier);

}  // namespace palpate
