#include "drawn_poses.hpp"

namespace palpate {

Press as_unknown(const Press& press, const RecognitionBins& bins, Random& random) {
  const PoseLattice& lattice = bins.lattice;
  const auto anywhere = [&](const Axis& axis) { return random.uniform(axis.lower, axis.upper); };
  const auto between_bins = [&](const Axis& axis) {
    return random.uniform(-0.5, 0.5) * axis.step();
  };
  const glm::dvec2 here_mm = press.T_object_robot->translation_mm;
  // One draw per statement: within a statement the compiler chooses the order of evaluation.
  const double x_mm = bins.auto_pivot ? here_mm.x + between_bins(lattice.x_mm)  //
                                      : anywhere(lattice.x_mm);
  const double y_mm = bins.auto_pivot ? here_mm.y + between_bins(lattice.y_mm)  //
                                      : anywhere(lattice.y_mm);
  const double theta_rad = anywhere(lattice.theta_rad);

  Press unknown = press;
  unknown.T_object_robot = lattice.T_object_robot(x_mm, y_mm, theta_rad);
  const Pose T_drawn_robot = inverse(*unknown.T_object_robot) * *press.T_object_robot;
  for (Touch& touch : unknown.touches) {
    touch.T_robot_sensor = T_drawn_robot * touch.T_robot_sensor;
  }
  return unknown;
}

Press together(std::span<const Press* const> presses) {
  Press all = *presses.front();
  const Pose T_robot_object = inverse(*all.T_object_robot);
  for (const Press* press : presses.subspan(1)) {
    const Pose T_robot_own = T_robot_object * *press->T_object_robot;
    for (Touch touch : press->touches) {
      touch.T_robot_sensor = T_robot_own * touch.T_robot_sensor;
      all.touches.push_back(touch);
    }
  }
  return all;
}

}  // namespace palpate
