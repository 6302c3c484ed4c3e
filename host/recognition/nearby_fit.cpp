#include "recognition/nearby_fit.hpp"

#include <numbers>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace palpate {

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

}  // namespace palpate
