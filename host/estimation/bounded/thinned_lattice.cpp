#include "estimation/bounded/thinned_lattice.hpp"

#include <algorithm>

namespace palpate {

PoseLattice thinned(PoseLattice lattice) {
  constexpr double fine_mm = 0.1;
  constexpr int least_bins = 3;  // of fewer, the middle ones say little of a narrow region's ends
  for (Axis* axis : {&lattice.x_mm, &lattice.y_mm}) {
    const double step = axis->step();
    const int widest = axis->count / least_bins;
    const double wanted = std::min<double>(fine_mm / step, widest);
    // An odd number, so that the middle one is a centre.
    const int every = static_cast<int>((wanted - 1.0) / 2.0) * 2 + 1;
    if (every > 1) {
      axis->count /= every;
      axis->upper = axis->lower + axis->count * every * step;
    }
  }
  return lattice;
}

}  // namespace palpate
