#pragma once

#include <cstdint>

namespace palpate {

/// Counts up to here are exact in float64, in which datasets are read.
inline constexpr std::uint64_t largest_count = std::uint64_t{1} << 53;

/// Adds to a count of lost frames, which stays at largest_count: what a board or a file says was
/// lost may be anything.
inline void count_lost(std::uint64_t& count, std::uint64_t more) {
  count = more < largest_count - count ? count + more : largest_count;
}

}  // namespace palpate
