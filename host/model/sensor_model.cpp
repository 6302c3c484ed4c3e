#include <algorithm>
#include <cmath>
#include <cstddef>

#include <fmt/format.h>

#include "model/refuse.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

void InverseSensorModel::validate() const {
  if (!(spread_mm >= least_length_mm && spread_mm <= most_length_mm)) {
    refuse(fmt::format("spread = {} mm", spread_mm), "give {:g} to {:g} mm", least_length_mm,
           most_length_mm);
  }
  // Outside these bounds, increments in float32 miss the tolerance of MapBuilder::build().
  constexpr double largest_peak = 0.9999;
  if (!(peak >= least_peak && peak <= largest_peak)) {
    refuse(fmt::format("peak = {}", peak),
           "must be at least {:g}, or a reading would say nothing, and at most {}, or a reading "
           "would make a cell certain",
           least_peak, largest_peak);
  }
  if (!(prior >= least_prior && prior <= 1.0 - least_prior)) {
    refuse(fmt::format("prior = {}", prior), "must lie between {0:g} and 1 - {0:g}", least_prior);
  }
}

double InverseSensorModel::increment(Reading reading, double distance_mm) const {
  if (reading == Reading::unknown) {
    return 0.0;
  }
  const double g = peak * std::exp(-distance_mm * distance_mm / (2.0 * spread_mm * spread_mm));
  // Eq. 5 put into log odds; log1p keeps the small increments far from the element exact.
  return is_contact(reading) ? std::log1p(g * (1.0 - prior) / prior) - std::log1p(-g)
                             : std::log1p(-g) - std::log1p(g * prior / (1.0 - prior));
}

double InverseSensorModel::support_radius_mm(std::size_t readings, double tolerance) const {
  // Where g <= 1/2 an increment is at most 2 g / min(m, 1 - m), since log1p(x) <= x and
  // -log1p(-g) <= 2 g. `readings` of them stay below the tolerance once g does below this:
  const double least = std::min(prior, 1.0 - prior) / 2.0;
  const double g =
      std::min(0.5, tolerance * least / static_cast<double>(std::max<std::size_t>(readings, 1)));
  return spread_mm * std::sqrt(std::max(0.0, 2.0 * std::log(peak / g)));
}

}  // namespace palpate
