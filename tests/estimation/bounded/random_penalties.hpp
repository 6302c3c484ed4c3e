#pragma once

#include <cstdint>

#include "reading_penalties.hpp"

namespace palpate {

/// Penalties of independent squares, from 0 to `largest`; the largest occurs, also beyond.
SquarePenalties random_penalties(int nx, int ny, std::uint16_t largest, std::uint64_t seed);

/// The least penalty within the window of side + 1 squares along each axis that begins at square
/// (x, y), by definition.
std::uint16_t least_penalty(const SquarePenalties& penalties, int side, int x, int y);

}  // namespace palpate
