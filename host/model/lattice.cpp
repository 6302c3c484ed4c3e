#include "palpate/lattice.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "model/refuse.hpp"

namespace palpate {

namespace {

// The bound serves millimetres and radians alike.
bool is_near(double place) { return std::abs(place) <= farthest_mm; }

void validate_axis(const char* name, const Axis& axis) {
  if (axis.count < 1) {
    throw Error(Fault::input, fmt::format("bins {} = {}: give at least 1", name, axis.count));
  }
  if (!is_near(axis.lower) || !is_near(axis.upper)) {
    throw Error(Fault::input, fmt::format("range {} = {}:{}: give numbers within +-{:g}", name,
                                          axis.lower, axis.upper, farthest_mm));
  }
  if (axis.lower > axis.upper) {
    throw Error(Fault::input, fmt::format("range {} = {}:{}: reversed, write the lower end first",
                                          name, axis.lower, axis.upper));
  }
}

/// How much wider than the full circle a range of theta is, rad; 0 within rounding of its ends.
double beyond_circle_rad(const Axis& theta_rad) {
  constexpr double circle_rad = 2.0 * std::numbers::pi;
  // Ends given in degrees are rounded, and far ones keep few digits.
  const double farthest_rad = std::max(std::abs(theta_rad.lower), std::abs(theta_rad.upper));
  const double rounding = std::max(1e-9, 4.0 * farthest_rad * 0x1p-53);
  const double beyond = theta_rad.upper - theta_rad.lower - circle_rad;
  return std::abs(beyond) <= rounding ? 0.0 : beyond;
}

std::int64_t nearest_index(const Axis& axis, double value) {
  const double index = axis.step() > 0.0 ? std::floor((value - axis.lower) / axis.step()) : 0.0;
  return static_cast<std::int64_t>(std::clamp(index, 0.0, axis.count - 1.0));
}

}  // namespace

PoseLattice& PoseLattice::collapse_fixed() {
  for (Axis* axis : {&x_mm, &y_mm, &theta_rad}) {
    if (axis->lower == axis->upper && axis->count > 1) {
      axis->count = 1;
    }
  }
  return *this;
}

void PoseLattice::validate() const {
  validate_axis("x_mm", x_mm);
  validate_axis("y_mm", y_mm);
  validate_axis("theta_rad", theta_rad);
  if (exceeds_circle()) {
    refuse(fmt::format("range theta_rad = {}:{}", theta_rad.lower, theta_rad.upper),
           "wider than the full circle, poses would count twice; give a range of at most 2 pi");
  }
  if (!is_near(pivot_mm.x) || !is_near(pivot_mm.y)) {
    throw Error(Fault::input, fmt::format("pivot_mm = {},{}: give numbers within +-{:g}",
                                          pivot_mm.x, pivot_mm.y, farthest_mm));
  }
}

bool PoseLattice::exceeds_circle() const { return beyond_circle_rad(theta_rad) > 0.0; }

bool PoseLattice::full_circle() const { return beyond_circle_rad(theta_rad) == 0.0; }

Pose PoseLattice::T_object_robot(std::int64_t index) const {
  if (index < 0 || index >= bins()) {
    throw Error(Fault::input, fmt::format("bin {}: there are {}, counted from 0", index, bins()));
  }
  const std::int64_t in_plane = index % plane();
  return T_object_robot(x_mm.centre(static_cast<int>(in_plane % x_mm.count)),
                        y_mm.centre(static_cast<int>(in_plane / x_mm.count)),
                        theta_rad.centre(static_cast<int>(index / plane())));
}

Pose PoseLattice::T_object_robot(double x, double y, double theta) const {
  return {glm::dvec2(x, y) - rotate(theta, pivot_mm), theta};
}

std::int64_t PoseLattice::bin_of(const Pose& T_object_robot) const {
  validate();
  require_finite(T_object_robot);
  const glm::dvec2 place_mm = T_object_robot * pivot_mm;
  const double middle_rad = (theta_rad.lower + theta_rad.upper) / 2.0;
  const double turn_rad = wrap_angle(T_object_robot.theta_rad - middle_rad);
  return nearest_index(theta_rad, middle_rad + turn_rad) * plane() +
         nearest_index(y_mm, place_mm.y) * x_mm.count + nearest_index(x_mm, place_mm.x);
}

}  // namespace palpate
