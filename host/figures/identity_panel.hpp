#pragma once

#include <string>
#include <vector>

#include "figures/canvas.hpp"

namespace palpate {

/// Width of the lines' labels to the right of the plot.
inline constexpr double identity_labels_px = 264.0;

/// Draws the identity probabilities over the touches, one line per label. `identity` is
/// [touch][object]; objects of equal label add up. Where there are many labels, those that end most
/// probable are in colour and the others grey.
void draw_identity(Canvas& canvas, const Box& plot, const std::vector<std::string>& labels,
                   const std::vector<std::vector<double>>& identity);

}  // namespace palpate
