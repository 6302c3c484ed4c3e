#include "recognition/object_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace palpate {

namespace {

/// That of z, of which one in ten spreads wider, where something else widens all of them.
double density(const Fit& fit, double mean, double more_sd) {
  constexpr double odd_share = 0.1;
  constexpr double odd_sd = 5.0;
  constexpr double farthest = 30.0;  // no density is 0
  const double from_mean = std::clamp(fit.z, -farthest, farthest) - mean;
  const auto normal = [&](double own_sd) {
    const double sd = std::hypot(own_sd, more_sd);
    return std::exp(-0.5 * from_mean * from_mean / (sd * sd)) / sd;
  };
  return (1.0 - odd_share) * normal(1.0) + odd_share * normal(odd_sd);
}

}  // namespace

ObjectFit fit_of(const Mode& mode, const std::optional<RefinedPose>& refined,
                 std::span<const TouchEvidence> touches, const RecognitionTask& task) {
  const std::size_t in_contact = touches_in_contact(touches);
  if (in_contact == 0) {
    return {};
  }
  const auto object = static_cast<std::size_t>(mode.object);
  const OccupancyGrid& map = task.hypotheses[object].compared();
  const FitScale scale = task.fit_scale_for(touches);
  if (!refined) {
    const std::optional<Fit> fit =
        best_fit_near(touches, mode.T_object_robot, map, task.contact(), object);
    return {.fit = scale.of(fit.value(), in_contact)};
  }
  const std::vector<std::optional<FitSums>> sums =
      fit_sums(touches, refined->T_object_robot, map, task.contact(), task.touch_sd(), object);
  ObjectFit result{.fit = scale.of(combined_fit(sums).value(), in_contact)};
  FitScale of_one = scale;
  if (in_contact > 1) {
    of_one.single_touch.reset();  // the pose is that of all touches
  }
  for (const std::optional<FitSums>& touch : sums) {
    const std::optional<Fit> fit = combined_fit(std::span(&touch, 1));
    result.touches.push_back(fit ? std::optional(of_one.of(*fit, 1).z) : std::nullopt);
  }
  return result;
}

std::optional<Fit> best_fit_near(std::span<const TouchEvidence> touches, const Pose& T_object_robot,
                                 const OccupancyGrid& map, const ContactModel& contact,
                                 std::size_t object) {
  constexpr double step_mm = 0.5;
  constexpr double step_rad = 0.04 * std::numbers::pi;
  std::optional<Fit> best = evidence_fit(touches, T_object_robot, map, contact, {}, object);
  if (!best) {
    return {};
  }
  const glm::dvec2 middle_mm =
      map.origin_mm + 0.5 * map.cell_mm * glm::dvec2(map.nx - 1, map.ny - 1);
  Pose best_pose = T_object_robot;
  for (const double share : {0.5, 0.25, 0.125}) {
    for (const glm::dvec3 move :
         {glm::dvec3(step_mm, 0, 0), glm::dvec3(0, step_mm, 0), glm::dvec3(0, 0, step_rad)}) {
      for (const double sign : {share, -share}) {
        const glm::dvec2 shift_mm = sign * glm::dvec2(move);
        const double turn_rad = sign * move.z;
        const Pose moved =
            Pose{shift_mm + middle_mm - rotate(turn_rad, middle_mm), turn_rad} * best_pose;
        const std::optional<Fit> fit = evidence_fit(touches, moved, map, contact, {}, object);
        if (fit->z > best->z) {
          best = fit;
          best_pose = moved;
        }
      }
    }
  }
  return best;
}

double stranger_density(const Fit& fit, std::size_t touches, const FitScale& scale) {
  if (touches == 1 && scale.stranger_single_touch) {
    const auto [mean, sd] = *scale.stranger_single_touch;
    return density(fit, mean, std::sqrt(std::max(sd * sd - 1.0, 0.0)));
  }
  const double each_sd = scale.stranger_sd.value_or(usual_stranger_sd);
  return density(fit, 0.0, each_sd * (static_cast<double>(touches) - 1.0));
}

double misfit_nats(const Fit& fit, std::size_t touches, const FitScale& scale) {
  // The scale is of the touches that were learned from. Of 160 single presses by a sensor whose
  // elements have other gains, one in ten has z below -3.9 and one in twenty below -5.4: the lower
  // half of a standard deviation of 3.
  constexpr double single_touch_sd = 3.0;
  const bool single_touch = touches == 1 && scale.stranger_single_touch;
  const double learned =
      density(fit, 0.0, single_touch ? std::sqrt(single_touch_sd * single_touch_sd - 1.0) : 0.0);
  return std::log(stranger_density(fit, touches, scale) / learned);
}

}  // namespace palpate
