#pragma once

#include <cstdint>

namespace palpate {

/// Largest count that float64, the type in which datasets are read, holds exactly.
inline constexpr std::uint64_t largest_count = std::uint64_t{1} << 53;

/// Adds `more` to a count of lost frames and stops at largest_count: a board or a file may claim
/// any loss.
inline void count_lost(std::uint64_t& count, std::uint64_t more) {
  count = more < largest_count - count ? count + more : largest_count;
}

}  // namespace palpate
