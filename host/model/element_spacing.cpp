#include "model/element_spacing.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include <glm/geometric.hpp>

namespace palpate {

std::optional<ElementSpacing> spacing_of(std::span<const glm::dvec2> elements_mm, double alike_mm) {
  if (elements_mm.size() < 2) {
    return {};
  }
  // Two elements are at least as far apart as along a direction; along this direction, no two
  // elements of a regular array coincide.
  const glm::dvec2 direction{std::cos(0.5), std::sin(0.5)};
  const auto along = [&](std::size_t i) { return glm::dot(elements_mm[i], direction); };
  std::vector<std::size_t> order(elements_mm.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return along(a) < along(b); });

  ElementSpacing spacing{.nearest_mm = {std::numeric_limits<double>::infinity(), 0.0},
                         .closest = {}};
  for (std::size_t at = 0; at < order.size(); ++at) {
    const std::size_t i = order[at];
    double nearest_mm = std::numeric_limits<double>::infinity();
    std::size_t nearest = i;
    // Returns false where no element further on can be nearer.
    const auto look_at = [&](std::size_t j) {
      if (std::abs(along(j) - along(i)) >= nearest_mm) {
        return false;
      }
      if (const double distance =
              std::hypot(elements_mm[i].x - elements_mm[j].x, elements_mm[i].y - elements_mm[j].y);
          distance > alike_mm && distance < nearest_mm) {
        nearest_mm = distance;
        nearest = j;
      }
      return true;
    };
    for (std::size_t next = at + 1; next < order.size() && look_at(order[next]); ++next) {
    }
    for (std::size_t before = at; before > 0 && look_at(order[before - 1]); --before) {
    }
    if (nearest_mm < spacing.nearest_mm.least) {
      spacing.nearest_mm.least = nearest_mm;
      spacing.closest = {std::min(i, nearest), std::max(i, nearest)};
    }
    spacing.nearest_mm.most = std::max(spacing.nearest_mm.most, nearest_mm);
  }
  return spacing;
}

}  // namespace palpate
