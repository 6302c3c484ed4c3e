#pragma once

#include <cstdint>

#include "estimation/bounded/tables/window_table.hpp"

namespace palpate {

/// Penalties of independent squares, from 0 to `largest`; the largest occurs, also beyond.
SquarePenalties random_penalties(int nx, int ny, std::uint16_t largest, std::uint64_t seed);

/// The least penalty within so many squares along each axis from square (x, y) on, by definition.
std::uint16_t least_penalty(const SquarePenalties& penalties, int window, int x, int y);

}  // namespace palpate
