#include "learning/drawn_poses.hpp"

namespace palpate {

Press as_unknown(const Press& press, const RecognitionBins& bins, Random& random) {
  const PoseLattice& lattice = bins.lattice;
  const auto drawn = [&](const Axis& axis, double here_mm) {
    return bins.auto_pivot ? here_mm + random.uniform(-0.5, 0.5) * axis.step()
                           : random.uniform(axis.lower, axis.upper);
  };
  // One draw per statement: within a statement the compiler chooses the order of evaluation.
  const double x_mm = drawn(lattice.x_mm, press.T_object_robot->translation_mm.x);
  const double y_mm = drawn(lattice.y_mm, press.T_object_robot->translation_mm.y);
  const double theta_rad = random.uniform(lattice.theta_rad.lower, lattice.theta_rad.upper);

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
