#pragma once

#include <string>
#include <vector>

#include "canvas.hpp"

namespace palpate {

/// Width that the lines' labels take to the right of the plot.
inline constexpr double identity_labels_px = 264.0;

/// Identity probabilities over the touches, a line per label: `identity` is [touch][object],
/// objects of equal label add up. Of many labels, those that end most probable stand out in colour
/// and the others are grey.
void draw_identity(Canvas& canvas, const Box& plot, const std::vector<std::string>& labels,
                   const std::vector<std::vector<double>>& identity);

}  // namespace palpate
