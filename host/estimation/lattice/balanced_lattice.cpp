#include "palpate/balanced_lattice.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "estimation/displacement_weights.hpp"
#include "estimation/hypotheses.hpp"
#include "estimation/lattice/refinement.hpp"
#include "gpu/command_stream.hpp"
#include "model/bounding_box.hpp"
#include "model/refuse.hpp"

namespace palpate {

namespace {

/// The widest step that suits a map. A map changes little over less than a cell, since cells are
/// interpolated, or than the spread of its sensor model, since every cell is a sum of Gaussians.
double step_for(const OccupancyGrid& map, BinWidth width) {
  // docs/refinement.md holds the measurements behind these numbers.
  const double spreads = width == BinWidth::fine ? 1.0 : 2.0;
  const double unknown_mm = width == BinWidth::fine ? 0.0 : map.cell_mm;
  return balanced_step * std::max(map.cell_mm, spreads * map.spread_mm.value_or(unknown_mm));
}

/// Root mean square distance of an object's cells from the pivot, wherever in the region that is.
double lever_mm(const OccupancyGrid& map, const PoseLattice& region) {
  const Body body = displaced_body(map);
  const double width_mm = region.x_mm.upper - region.x_mm.lower;
  const double height_mm = region.y_mm.upper - region.y_mm.lower;
  const glm::dvec2 middle_mm(region.x_mm.lower + width_mm / 2.0,
                             region.y_mm.lower + height_mm / 2.0);
  const glm::dvec2 offset_mm = body.centroid_mm - middle_mm;
  return std::sqrt(body.inertia_mm2 + glm::dot(offset_mm, offset_mm) +
                   (width_mm * width_mm + height_mm * height_mm) / 12.0);
}

/// How much wider the steps may be where touches are displaced and objects slip, by standard
/// deviations of the same unit as the step.
double step_factor(double touch_sd, double slip_sd, double step) {
  // docs/refinement.md holds the measurements behind these numbers.
  constexpr double of_touch_sd = 0.5;
  constexpr double of_slip_sd = 1.25;
  constexpr double limit = 2.5;
  return std::clamp(std::max(of_touch_sd * touch_sd, of_slip_sd * slip_sd) / step, 1.0, limit);
}

double count_of(double extent, double step) { return std::max(1.0, std::ceil(extent / step)); }

}  // namespace

BalancedLattice balanced_lattice(const PoseLattice& region, std::span<const Hypothesis> hypotheses,
                                 std::int64_t most_bins, BinWidth width,
                                 const DisplacementSd& touch_sd, const DisplacementSd& slip_sd) {
  validate_hypotheses(hypotheses);
  PoseLattice lattice = region;
  for (Axis* axis : {&lattice.x_mm, &lattice.y_mm, &lattice.theta_rad}) {
    axis->count = 1;
  }
  lattice.validate();
  validate_displacement(touch_sd, lattice, "touch_sd");
  validate_displacement(slip_sd, lattice, "slip_sd");
  double wanted_mm = std::numeric_limits<double>::infinity();
  double longest_mm = 0.0;
  for (const Hypothesis& hypothesis : hypotheses) {
    wanted_mm = std::min(wanted_mm, step_for(hypothesis.map, width));
    longest_mm = std::max(longest_mm, lever_mm(hypothesis.map, region));
  }
  const bool may_widen = width != BinWidth::fine;
  const double xy_factor = may_widen ? step_factor(touch_sd.mm, slip_sd.mm, wanted_mm) : 1.0;
  const double theta_factor =
      may_widen ? step_factor(touch_sd.rad * longest_mm, slip_sd.rad * longest_mm, wanted_mm) : 1.0;
  // Shorter by as much as their steps are wider.
  const double extents_mm[] = {
      (lattice.x_mm.upper - lattice.x_mm.lower) / xy_factor,
      (lattice.y_mm.upper - lattice.y_mm.lower) / xy_factor,
      (lattice.theta_rad.upper - lattice.theta_rad.lower) * longest_mm / theta_factor};
  const auto bins = [&](double step_mm) {
    double product = static_cast<double>(hypotheses.size());
    for (const double extent_mm : extents_mm) {
      product *= count_of(extent_mm, step_mm);
    }
    return product;
  };
  // Counts are ints.
  const auto limit =
      static_cast<double>(std::min<std::int64_t>(most_bins, std::numeric_limits<int>::max()));
  double step_mm = wanted_mm;
  // Axes that are down to one bin give no more, so the cube root may fall short.
  for (double fewer = bins(step_mm); fewer > limit; fewer = bins(step_mm)) {
    if (fewer == static_cast<double>(hypotheses.size())) {
      throw Error(Fault::input, fmt::format("{} objects: a bin for each is more than {}; use fewer",
                                            hypotheses.size(), most_bins));
    }
    step_mm *= std::clamp(std::cbrt(fewer / limit), 1.01, 1e3);
  }
  lattice.x_mm.count = static_cast<int>(count_of(extents_mm[0], step_mm));
  lattice.y_mm.count = static_cast<int>(count_of(extents_mm[1], step_mm));
  lattice.theta_rad.count = static_cast<int>(count_of(extents_mm[2], step_mm));
  return {.lattice = lattice, .step_mm = step_mm * xy_factor, .coarsened = step_mm > wanted_mm};
}

TouchRegion touch_region(std::span<const Hypothesis> hypotheses, double reach_mm) {
  validate_hypotheses(hypotheses);
  if (!(reach_mm >= 0.0 && reach_mm <= farthest_mm)) {
    refuse(fmt::format("reach of the array = {} mm", reach_mm), "give 0 to {:g}", farthest_mm);
  }
  BoundingBox all;
  glm::dvec2 largest_mm(0.0);
  for (const Hypothesis& hypothesis : hypotheses) {
    const BoundingBox box = occupied_box(hypothesis.map);
    all.take_in(box.lower);
    all.take_in(box.upper);
    largest_mm = glm::max(largest_mm, box.extent());
  }
  const glm::dvec2 reach(reach_mm);
  const glm::dvec2 together = all.extent() + 2.0 * reach;
  const glm::dvec2 apart_mm = largest_mm + 2.0 * reach;
  TouchRegion region{.lattice = {.x_mm = {all.lower.x - reach_mm, all.upper.x + reach_mm, 1},
                                 .y_mm = {all.lower.y - reach_mm, all.upper.y + reach_mm, 1},
                                 .theta_rad = {0.0, 2.0 * std::numbers::pi, 1}},
                     .excess = together.x * together.y / (apart_mm.x * apart_mm.y)};
  region.lattice.validate();
  return region;
}

std::int64_t most_bins_on(const Device& device) {
  constexpr std::uint64_t bytes_per_bin = 8;
  const std::uint64_t held = device.memory_bytes() / 2 / bytes_per_bin;
  return static_cast<std::int64_t>(std::min(held, static_cast<std::uint64_t>(most_balanced_bins)));
}

}  // namespace palpate
