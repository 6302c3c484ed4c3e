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
/// the mode's own, where all angles look alike (n = 0) at those more than 1/16 of a turn away.
double share_at_other_turns(const Marginals& marginals, double mode_rad, int n) {
  const double own_rad = std::numbers::pi / (n == 0 ? 8 : n);
  double all = 0.0;
  double other = 0.0;
  for (std::size_t k = 0; k < marginals.theta.size(); ++k) {
    const double theta_rad = marginals.grid.theta_rad.centre(static_cast<int>(k));
    all += marginals.theta[k];
    if (std::abs(wrap_angle(theta_rad - mode_rad, circle_rad)) > own_rad) {
      other += marginals.theta[k];
    }
  }
  return all > 0.0 ? other / all : 0.0;
}

}  // namespace

std::optional<std::string> turned_alike(const Recogniser& recogniser, const RecognitionTask& task,
                                        const RecognitionStep& step, const GroundTruth& truth) {
  constexpr double least_share = 0.05;
  constexpr double least_error_mm = 1.0;
  const OccupancyGrid& map = task.hypotheses[step.mode.object].map;
  const int n = map.suggested_symmetry.value_or(1);
  if (map.symmetry != 1 || n == 1) {
    return {};
  }
  std::string evidence;
  if (const std::optional<double> error_mm = step.pose_error_mm()) {
    const double ignored_mm =
        pose_error_mm(task.bodies[step.mode.object].value(), n, step.pose(), *truth.T_object_robot);
    if (*error_mm - ignored_mm > least_error_mm) {
      evidence =
          fmt::format("the pose error of {:.2f} mm is {:.2f} mm where such turns do not count",
                      *error_mm, ignored_mm);
    }
  }
  if (evidence.empty()) {
    const double share = share_at_other_turns(recogniser.marginals(step.mode.object),
                                              step.mode.T_object_robot.theta_rad, n);
    if (share < least_share) {
      return {};
    }
    evidence = fmt::format("{:.0f} % of its belief lies at other such turns", 100.0 * share);
  }
  return fmt::format("{} looks the same after {}, and {}; build its map with `symmetry {}`",
                     map.label, n == 0 ? "any turn" : fmt::format("every 1/{} of a turn", n),
                     evidence, n);
}

}  // namespace palpate
