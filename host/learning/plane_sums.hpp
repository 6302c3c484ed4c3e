#pragma once

#include <cstddef>
#include <span>

namespace palpate {

/// Rows are summed in pieces of so many numbers.
inline constexpr std::size_t sum_lanes = 16;

/// Adds planes of rows up, in the order given: sums[j, i] = sum of planes[k][j, i]. A plane is
/// inside a wider table.
/// @param planes where each begins in its table; at least sum_lanes - 1 numbers are behind its last
/// @param width of the tables' rows
/// @param columns of the sums' rows, a multiple of sum_lanes
void sum_planes(std::span<const float* const> planes, std::size_t width, std::size_t rows,
                std::size_t columns, float* sums);

}  // namespace palpate
