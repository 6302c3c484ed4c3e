#include "random_penalties.hpp"

#include <algorithm>
#include <limits>

#include "support/synthetic.hpp"

namespace palpate {

SquarePenalties random_penalties(int nx, int ny, std::uint16_t largest, std::uint64_t seed) {
  Uniform random(seed);
  SquarePenalties penalties{.best = -0.3, .nx = nx, .ny = ny, .least = {}, .beyond = largest};
  for (int i = 0; i < nx * ny; ++i) {
    penalties.least.push_back(static_cast<std::uint16_t>(random(0.0, largest + 1.0)));
  }
  penalties.least.back() = largest;
  return penalties;
}

std::uint16_t least_penalty(const SquarePenalties& penalties, int window, int x, int y) {
  std::uint16_t least = std::numeric_limits<std::uint16_t>::max();
  for (int j = y; j < y + window; ++j) {
    for (int i = x; i < x + window; ++i) {
      const bool inside = i >= 0 && j >= 0 && i < penalties.nx && j < penalties.ny;
      least =
          std::min(least, inside ? penalties.least[static_cast<std::size_t>(j) * penalties.nx + i]
                                 : penalties.beyond);
    }
  }
  return least;
}

}  // namespace palpate
