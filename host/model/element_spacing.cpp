#include "model/element_spacing.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include <glm/geometric.hpp>

#include "palpate/map_builder.hpp"

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

std::optional<double> pitch_of(std::span<const glm::dvec2> elements_mm) {
  const std::optional<ElementSpacing> spacing = spacing_of(elements_mm);
  return spacing && spacing->nearest_mm.most > 0.0 ? std::optional(spacing->nearest_mm.most)
                                                   : std::nullopt;
}

double usual_spread_mm(std::optional<double> pitch_mm) {
  constexpr double of_pitch = 0.25;
  constexpr double alike = 0.1;  // a quarter of the pitch is 0.475 mm for DigiTacts
  const double usual_mm = InverseSensorModel{}.spread_mm;
  const double spread_mm = pitch_mm ? of_pitch * *pitch_mm : usual_mm;
  return std::abs(spread_mm - usual_mm) <= alike * usual_mm ? usual_mm : spread_mm;
}

double usual_spread_mm(std::span<const Recording> recordings) {
  std::optional<double> finest_mm;
  for (const Recording& recording : recordings) {
    const std::span<const glm::dvec2> all = recording.elements_mm;
    const std::size_t elements = recording.elements();
    for (std::size_t first = 0; elements > 0 && first < all.size(); first += elements) {
      if (const auto pitch_mm = pitch_of(all.subspan(first, elements))) {
        finest_mm = std::min(finest_mm.value_or(*pitch_mm), *pitch_mm);
      }
    }
  }
  return usual_spread_mm(finest_mm);
}

}  // namespace palpate
