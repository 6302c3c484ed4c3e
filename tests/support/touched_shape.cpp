#include "support/touched_shape.hpp"

#include <cmath>
#include <numbers>

#include "support/synthetic.hpp"

namespace palpate {

bool on_letter_l(const glm::dvec2& p_mm) {
  const bool stem = p_mm.x > -5.0 && p_mm.x < -1.0 && p_mm.y > -8.0 && p_mm.y < 8.0;
  const bool foot = p_mm.x > -5.0 && p_mm.x < 5.0 && p_mm.y > -8.0 && p_mm.y < -4.0;
  return stem || foot;
}

bool on_disc(const glm::dvec2& p_mm) { return std::hypot(p_mm.x, p_mm.y) < 7.0; }

OccupancyGrid map_of(const Silhouette& shape, const std::string& label) {
  OccupancyGrid map{
      .label = label, .cell_mm = 0.5, .origin_mm = {-14.0, -14.0}, .nx = 57, .ny = 57};
  for (int j = 0; j < map.ny; ++j) {
    for (int i = 0; i < map.nx; ++i) {
      map.log_odds.push_back(shape(map.centre_mm(i, j)) ? 3.0F : -3.0F);
    }
  }
  return map;
}

Recording touches_of(const Silhouette& shape, const Pose& T_object_robot, std::size_t touches,
                     std::uint64_t seed) {
  Uniform random(seed);
  Recording recording;
  recording.elements_mm = digitacts_array();
  for (std::size_t i = 0; i < touches; ++i) {
    const Pose T_object_sensor{{random(-7.0, 7.0), random(-9.0, 9.0)},
                               random(-std::numbers::pi, std::numbers::pi)};
    recording.T_robot_sensor.push_back(inverse(T_object_robot) * T_object_sensor);
    for (const glm::dvec2& element : recording.elements_mm) {
      recording.pressure.push_back(shape(T_object_sensor * element) ? 10.0 : 0.0);
    }
  }
  return recording;
}

}  // namespace palpate
