#include "estimation/lattice/blur_tables.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "palpate/pose.hpp"

namespace palpate {

namespace {

/// A Gaussian is cut off at as many standard deviations.
constexpr double reach = 4.0;

void set_two_floats(double value, float& high, float& low) {
  high = static_cast<float>(value);
  low = static_cast<float>(value - high);
}

/// A distance along an axis in whole bins and the rest. An axis of one bin keeps its place.
void set_shift(double distance_mm, const Axis& axis, float& whole, float& fraction,
               float& fraction_low) {
  // Farther than any lattice has bins, yet whole numbers are exact. So far is what is no number:
  // the difference of places beyond float64.
  constexpr double farthest = 1 << 23;
  const double bins = axis.count == 1 ? 0.0
                      : std::isnan(distance_mm)
                          ? farthest
                          : std::clamp(distance_mm / axis.step(), -farthest, farthest);
  whole = static_cast<float>(std::floor(bins));
  set_two_floats(bins - std::floor(bins), fraction, fraction_low);
}

}  // namespace

int blur_steps(double sd, const Axis& axis) {
  return axis.count > 1 ? static_cast<int>(std::ceil(reach * sd / axis.step())) : 0;
}

std::vector<float> blur_weights(double sd, const Axis& axis, int steps) {
  std::vector<float> weights{1.0F};
  for (int k = 1; k <= steps; ++k) {
    const double deviations = k * axis.step() / sd;
    weights.push_back(static_cast<float>(std::exp(-deviations * deviations / 2.0)));
  }
  return weights;
}

std::vector<float> blur_norms(const std::vector<float>& weights, const Axis& axis) {
  const int steps = static_cast<int>(weights.size()) - 1;
  std::vector<float> norms;
  for (int i = 0; i < axis.count; ++i) {
    double sum = 0.0;
    for (int k = std::max(-steps, -i); k <= std::min(steps, axis.count - 1 - i); ++k) {
      sum += weights[static_cast<std::size_t>(std::abs(k))];
    }
    norms.push_back(static_cast<float>(1.0 / sum));
  }
  return norms;
}

std::vector<shaders::Turn> touch_turns(const PoseLattice& lattice,
                                       const glm::dvec2& sensor_from_pivot_mm, int steps,
                                       std::vector<shaders::Turn> reuse) {
  std::vector<shaders::Turn> turns = std::move(reuse);
  turns.clear();
  for (int t = 0; t < lattice.theta_rad.count; ++t) {
    const double theta = lattice.theta_rad.centre(t);
    for (int k = -steps; k <= steps; ++k) {
      const double turned = theta + k * lattice.theta_rad.step();
      // Without a turn the place is the same, even one beyond float64.
      const glm::dvec2 shift_mm =
          k == 0 ? glm::dvec2(0.0)
                 : rotate(theta, sensor_from_pivot_mm) - rotate(turned, sensor_from_pivot_mm);
      shaders::Turn turn{};
      set_shift(shift_mm.x, lattice.x_mm, turn.whole_x, turn.fraction_x, turn.fraction_x_low);
      set_shift(shift_mm.y, lattice.y_mm, turn.whole_y, turn.fraction_y, turn.fraction_y_low);
      turns.push_back(turn);
    }
  }
  return turns;
}

std::vector<shaders::Turn> slip_turns(const PoseLattice& lattice,
                                      const std::vector<glm::dvec2>& centroids_mm, int steps) {
  const Axis& x = lattice.x_mm;
  const Axis& y = lattice.y_mm;
  std::vector<shaders::Turn> turns;
  for (const glm::dvec2& centroid : centroids_mm) {
    const glm::dvec2 first_mm = glm::dvec2(x.centre(0), y.centre(0)) - centroid;
    for (int k = -steps; k <= steps; ++k) {
      const double alpha = k * lattice.theta_rad.step();
      // R(alpha) - 1, applied to the first bin and to one bin more along each axis.
      const double c = -2.0 * std::sin(alpha / 2.0) * std::sin(alpha / 2.0);
      const double s = std::sin(alpha);
      shaders::Turn turn{};
      set_shift(c * first_mm.x - s * first_mm.y, x, turn.whole_x, turn.fraction_x,
                turn.fraction_x_low);
      set_shift(s * first_mm.x + c * first_mm.y, y, turn.whole_y, turn.fraction_y,
                turn.fraction_y_low);
      if (x.count > 1) {
        set_two_floats(c, turn.xx, turn.xx_low);
        set_two_floats(-s * y.step() / x.step(), turn.xy, turn.xy_low);
      }
      if (y.count > 1) {
        set_two_floats(s * x.step() / y.step(), turn.yx, turn.yx_low);
        set_two_floats(c, turn.yy, turn.yy_low);
      }
      turns.push_back(turn);
    }
  }
  return turns;
}

}  // namespace palpate
