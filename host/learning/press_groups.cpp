#include "learning/press_groups.hpp"

#include <algorithm>

namespace palpate {

std::optional<std::size_t> next_map(const FitTable& table, std::span<const double> best,
                                    double enough) {
  std::optional<std::size_t> next;
  double largest = 0.0;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    if (best[table.columns[c]] >= enough) {
      continue;
    }
    double gain = 0.0;
    for (std::size_t p = 0; p < best.size(); ++p) {
      gain += std::max(0.0, std::clamp(table.fit[p][c], 0.0, 1.0) - best[p]);
    }
    if (gain > largest) {
      largest = gain;
      next = c;
    }
  }
  return next;
}

}  // namespace palpate
