#include "recognition/warnings.hpp"

#include <cmath>
#include <cstddef>
#include <numbers>

#include <fmt/format.h>

#include "palpate/pose_error.hpp"

namespace palpate {

namespace {

constexpr double circle_rad = 2.0 * std::numbers::pi;

/// Share of an object's belief at angles that are nearer to another of its n likenesses than to
/// its own, where all angles look alike (n = 0) at those more than 1/16 of a turn away.
/// @param shares [theta]
double share_at_other_turns(const Axis& theta, std::span<const double> shares, double own_rad,
                            int n) {
  const double own_half_rad = std::numbers::pi / (n == 0 ? 8 : n);
  double all = 0.0;
  double other = 0.0;
  for (std::size_t k = 0; k < shares.size(); ++k) {
    const double theta_rad = theta.centre(static_cast<int>(k));
    all += shares[k];
    if (std::abs(wrap_angle(theta_rad - own_rad, circle_rad)) > own_half_rad) {
      other += shares[k];
    }
  }
  return all > 0.0 ? other / all : 0.0;
}

}  // namespace

bool may_look_alike(const OccupancyGrid& map) {
  return map.symmetry == 1 && map.suggested_symmetry.value_or(1) != 1;
}

int symmetry_told(const OccupancyGrid& map, const Axis& theta, std::span<const double> shares,
                  double own_rad, double temperature) {
  constexpr double least_share = 0.05;
  if (!may_look_alike(map)) {
    return map.symmetry;
  }
  const double other = share_at_other_turns(theta, shares, own_rad, *map.suggested_symmetry);
  // Turns weigh as other poses do.
  const double odds = std::pow(other / (1.0 - other), 1.0 / temperature);
  return odds < least_share / (1.0 - least_share) ? map.symmetry : *map.suggested_symmetry;
}

int symmetry_told(const Recogniser& recogniser, const RecognitionTask& task,
                  const RecognitionStep& step) {
  const OccupancyGrid& map = task.hypotheses[step.mode.object].map;
  if (!may_look_alike(map)) {
    return map.symmetry;  // the marginals are not asked for
  }
  const Marginals marginals = recogniser.marginals(step.mode.object);
  return symmetry_told(map, marginals.grid.theta_rad, marginals.theta,
                       step.mode.T_object_robot.theta_rad,
                       task.temperature_after(recogniser.evidence()));
}

std::optional<std::string> turned_alike(const RecognitionTask& task, const RecognitionStep& step) {
  constexpr double least_error_mm = 1.0;
  const OccupancyGrid& map = task.hypotheses[step.mode.object].map;
  const int n = map.suggested_symmetry.value_or(1);
  if (map.symmetry != 1 || n == 1) {
    return {};
  }
  const std::string alike =
      fmt::format("{} looks the same after {}", map.label,
                  n == 0 ? "any turn" : fmt::format("every 1/{} of a turn", n));
  if (step.symmetry == n) {
    return fmt::format(
        "{}, and the touches do not tell such turns apart: they count as equal; build its map with "
        "`symmetry {}` where they always are, with `symmetry 1` where they never are",
        alike, n);
  }
  const std::optional<double> error_mm = step.pose_error_mm();
  if (!error_mm) {
    return {};
  }
  const double ignored_mm =
      pose_error_mm(step.body.value(), n, step.pose(), *step.truth.T_object_robot);
  return *error_mm - ignored_mm > least_error_mm
             ? std::optional(
                   fmt::format("{}, and the pose error of {:.2f} mm is {:.2f} mm where "
                               "such turns do not count; build its map with `symmetry {}`",
                               alike, *error_mm, ignored_mm, n))
             : std::nullopt;
}

}  // namespace palpate
