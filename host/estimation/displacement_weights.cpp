#include "estimation/displacement_weights.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "palpate/error.hpp"

namespace palpate {

namespace {

/// A Gaussian is cut off at as many standard deviations.
constexpr double reach_sd = 4.0;
/// Steps into which a bin is divided by the places of taps.
constexpr double fractions_of_bin = 0x1p20;

double widest_along(const Axis& axis) {
  return axis.count > 1 ? axis.upper - axis.lower : std::numeric_limits<double>::infinity();
}

void require_sd(double sd, double widest, const char* name, const char* unit) {
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

int blur_steps(const Axis& axis, double sd) {
  return axis.count > 1 ? static_cast<int>(std::ceil(reach_sd * sd / axis.step())) : 0;
}

double blur_weight(int steps, const Axis& axis, double sd) {
  const double deviations = steps == 0 ? 0.0 : steps * axis.step() / sd;
  return std::exp(-deviations * deviations / 2.0);
}

AxisBlur::AxisBlur(const Axis& axis, double sd, int bins)
    : steps(std::min(blur_steps(axis, sd), axis.count - 1)) {
  std::vector<double> of_bins;
  for (int k = 0; k <= steps; ++k) {
    of_bins.push_back(blur_weight(k, axis, sd));
  }
  const auto between = [&](int from, int to) {
    const int distance = std::abs(to - from);
    return distance <= steps ? of_bins[distance] : 0.0;
  };
  for (int tile = 0; tile * bins - (bins - 1) <= steps; ++tile) {
    double largest = 0.0;
    for (int from = 0; from < bins; ++from) {
      double sum = 0.0;
      for (int to = tile * bins; to < (tile + 1) * bins; ++to) {
        sum += between(from, to);
      }
      largest = std::max(largest, sum);
    }
    weight.push_back(largest);
  }
  for (int first = 0; first < axis.count; first += bins) {
    double largest = 0.0;
    for (int bin = first; bin < std::min(first + bins, axis.count); ++bin) {
      double inside = 0.0;
      for (int to = std::max(0, bin - steps); to <= std::min(axis.count - 1, bin + steps); ++to) {
        inside += between(bin, to);
      }
      largest = std::max(largest, 1.0 / inside);
    }
    scale.push_back(largest);
  }
}

DisplacementWeights::DisplacementWeights(const PoseLattice& lattice, const DisplacementSd& sd)
    : lattice_(lattice), sd_(sd), theta_steps_(blur_steps(lattice.theta_rad, sd.rad)) {}

std::vector<Tap> DisplacementWeights::taps(int theta, const glm::dvec2& sensor_from_pivot_mm,
                                           std::vector<Tap> reuse) const {
  std::vector<Tap> taps = std::move(reuse);
  taps.clear();
  const Axis& angles = lattice_.theta_rad;
  const double theta_rad = angles.centre(theta);
  const glm::dvec2 sensor_mm = rotate(theta_rad, sensor_from_pivot_mm);
  for (int k = -theta_steps_; k <= theta_steps_; ++k) {
    if (!lattice_.full_circle() && (theta + k < 0 || theta + k >= angles.count)) {
      continue;
    }
    Tap tap{.theta = ((theta + k) % angles.count + angles.count) % angles.count,
            .steps = k,
            .weight = blur_weight(k, angles, sd_.rad)};
    const glm::dvec2 shift_mm =
        k == 0 ? glm::dvec2(0.0)
               : sensor_mm - rotate(theta_rad + k * angles.step(), sensor_from_pivot_mm);
    bool inside = true;
    const auto split = [&](const Axis& axis, double mm, int& bins, double& fraction) {
      const double steps = axis.count == 1
                               ? 0.0
                               : std::round(mm / axis.step() * fractions_of_bin) / fractions_of_bin;
      // Written so that what is no number lies outside.
      if (!(std::abs(steps) < axis.count + 1.0)) {
        inside = false;
        return;
      }
      bins = static_cast<int>(std::floor(steps));
      fraction = steps - bins;
    };
    split(lattice_.x_mm, shift_mm.x, tap.bins.x, tap.fraction.x);
    split(lattice_.y_mm, shift_mm.y, tap.bins.y, tap.fraction.y);
    if (inside) {
      taps.push_back(tap);
    }
  }
  return taps;
}

glm::dvec2 DisplacementWeights::reach_mm() const {
  const auto along = [&](const Axis& axis) {
    // A step more for the bins about a tap's place.
    return axis.count == 1 ? 0.0
                           : (std::min(blur_steps(axis, sd_.mm), axis.count) + 1) * axis.step();
  };
  return {along(lattice_.x_mm), along(lattice_.y_mm)};
}

DisplacementSd widest_displacement(const PoseLattice& lattice) {
  return {.mm = std::min(widest_along(lattice.x_mm), widest_along(lattice.y_mm)),
          .rad = widest_along(lattice.theta_rad)};
}

void validate_displacement(const DisplacementSd& sd, const PoseLattice& lattice, const char* name) {
  const DisplacementSd widest = widest_displacement(lattice);
  require_sd(sd.mm, widest.mm, name, "mm");
  require_sd(sd.rad, widest.rad, name, "rad");
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
