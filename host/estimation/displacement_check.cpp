#include "estimation/displacement_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "palpate/error.hpp"

namespace palpate {

namespace {

double widest_along(const Axis& axis) {
  return axis.count > 1 ? axis.upper - axis.lower : std::numeric_limits<double>::infinity();
}

void require(double sd, double widest, const char* name, const char* unit) {
  if (!(sd >= 0.0 && std::isfinite(sd))) {
    throw Error(Fault::input,
                fmt::format("{} {} = {}: give a finite number from 0", name, unit, sd));
  }
  if (sd > widest) {
    throw Error(Fault::input,
                fmt::format("{0} {1} = {2}: wider than the region, {3:g} {1}; give less, or widen "
                            "the region",
                            name, unit, sd, widest));
  }
}

}  // namespace

DisplacementSd widest_displacement(const PoseLattice& lattice) {
  return {.mm = std::min(widest_along(lattice.x_mm), widest_along(lattice.y_mm)),
          .rad = widest_along(lattice.theta_rad)};
}

void validate_displacement(const DisplacementSd& sd, const PoseLattice& lattice, const char* name) {
  const DisplacementSd widest = widest_displacement(lattice);
  require(sd.mm, widest.mm, name, "mm");
  require(sd.rad, widest.rad, name, "rad");
}

std::optional<std::string> unresolved_by_steps(const DisplacementSd& sd, const PoseLattice& lattice,
                                               const char* name) {
  constexpr double degrees_per_rad = 180.0 / std::numbers::pi;
  for (const auto& [axis_name, axis, deviation, unit, scale] :
       {std::tuple("x", lattice.x_mm, sd.mm, "mm", 1.0),
        std::tuple("y", lattice.y_mm, sd.mm, "mm", 1.0),
        std::tuple("theta", lattice.theta_rad, sd.rad, "degrees", degrees_per_rad)}) {
    if (axis.count > 1 && deviation > 0.0 && deviation < axis.step() / 2.0) {
      return fmt::format(
          "the lattice does not resolve {0} of {1:.3g} {2}: its step of {3} is {4:.3g} {2}, more "
          "than twice as wide; use more bins",
          name, deviation * scale, unit, axis_name, axis.step() * scale);
    }
  }
  return {};
}

std::optional<std::string> unresolved_at(const Pose& T_robot_sensor, const DisplacementSd& sd,
                                         const PoseLattice& lattice, const char* name) {
  const double r_mm = glm::distance(T_robot_sensor.translation_mm, lattice.pivot_mm);
  const double moved_mm = r_mm * lattice.theta_rad.step();
  const double most_mm = 2.0 * std::max(sd.mm, lattice.x_mm.step());
  if (sd.rad == 0.0 || lattice.theta_rad.count == 1 || !(moved_mm > most_mm)) {
    return {};
  }
  return fmt::format(
      "the lattice does not resolve {}: a step of theta moves a sensor {:.3g} mm from the pivot by "
      "{:.3g} mm, more than {:.3g} mm; move the pivot near the touches, or use more bins",
      name, r_mm, moved_mm, most_mm);
}

}  // namespace palpate
