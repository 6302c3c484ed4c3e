#include "displacement_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

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

}  // namespace palpate
