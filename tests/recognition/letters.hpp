#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "palpate/estimate.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// The map of a simulated shape as the paper learns it, of symmetry 1.
OccupancyGrid learned_map(const std::string& shape);

/// Maps of the letters A, E, I, O and U as the paper learns them, with their symmetries.
const std::vector<Hypothesis>& learned_letters();

/// Simulated touches of a letter at a pose with |x| and |y| of at most 8 mm, with the truth.
Recording letter_touches(const std::string& letter, int touches, std::uint64_t seed);

}  // namespace palpate
