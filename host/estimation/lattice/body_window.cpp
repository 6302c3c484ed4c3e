#include "estimation/lattice/refinement.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include <glm/geometric.hpp>

#include "model/body_spread.hpp"

namespace palpate {

namespace {

/// Indices along an axis.
struct Range {
  int first = 0;
  int count = 0;
};

/// Steps within `reach`, at least one.
int steps_within(double reach, const Axis& axis) {
  return axis.count == 1
             ? 0
             : std::max(1, static_cast<int>(std::min<double>(axis.count, reach / axis.step())));
}

Range clipped(int first, int last, const Axis& axis) {
  first = std::max(0, first);
  return {first, std::min(axis.count - 1, last) - first + 1};
}

/// As many bins to either side, but no bin of the circle twice.
Range around_circle(int centre, int steps, const Axis& axis) {
  const int before = std::min(steps, (axis.count - 1) / 2);
  const int after = std::min(steps, axis.count / 2);
  return {centre - before, before + after + 1};
}

/// Bins whose distance from the centre bin is within [first, last].
Range bins_within(int centre, double first, double last, const Axis& axis) {
  if (axis.count == 1) {
    return {0, 1};
  }
  constexpr double rounding = 1e-6;
  const double limit = axis.count;
  const auto steps = [&](double distance) { return std::clamp(distance, -limit, limit); };
  return clipped(centre + static_cast<int>(std::ceil(steps(first / axis.step()) - rounding)),
                 centre + static_cast<int>(std::floor(steps(last / axis.step()) + rounding)), axis);
}

/// For each theta, a box that holds the window's bins. Thetas continue beyond the ends of the
/// circle.
std::vector<BinBox> boxes_around(const PoseLattice& lattice, int object, const Body& body,
                                 const BinIndex& centre, const BodyMotion& motion,
                                 double radius_mm) {
  const int most_steps = steps_within(radius_mm / spin_mm(body), lattice.theta_rad);
  const Range thetas =
      lattice.full_circle()
          ? around_circle(centre.theta, most_steps, lattice.theta_rad)
          : clipped(centre.theta - most_steps, centre.theta + most_steps, lattice.theta_rad);
  std::vector<BinBox> boxes;
  for (int theta = thetas.first; theta < thetas.first + thetas.count; ++theta) {
    const int steps = theta - centre.theta;
    const glm::dvec3 turned_mm = motion.by({0.0, 0.0, steps * lattice.theta_rad.step()});
    const double left_mm2 = radius_mm * radius_mm - turned_mm.z * turned_mm.z;
    const double reach_mm = std::sqrt(std::max(left_mm2, 0.0));
    const bool neighbours = std::abs(steps) <= 1;
    const auto range = [&](int bin, double swing_mm, const Axis& axis) {
      // Shifted against the swing, the body stays where it is.
      double first = -swing_mm - reach_mm;
      double last = -swing_mm + reach_mm;
      if (neighbours) {
        first = left_mm2 < 0.0 ? -axis.step() : std::min(first, -axis.step());
        last = left_mm2 < 0.0 ? axis.step() : std::max(last, axis.step());
      }
      return bins_within(bin, first, last, axis);
    };
    const Range y = range(centre.y, turned_mm.y, lattice.y_mm);
    const Range x = range(centre.x, turned_mm.x, lattice.x_mm);
    if (y.count > 0 && x.count > 0) {
      boxes.push_back({object, theta, y.first, y.count, x.first, x.count});
    }
  }
  return boxes;
}

}  // namespace

BodyMotion::BodyMotion(const Body& body, const glm::dvec3& place)
    : lever_mm_(body.centroid_mm - glm::dvec2(place)), spin_mm_(spin_mm(body)) {}

glm::dvec2 BodyMotion::swing_mm(double turn_rad) const {
  return rotate(turn_rad, lever_mm_) - lever_mm_;
}

glm::dvec3 BodyMotion::by(const glm::dvec3& change) const {
  return {glm::dvec2(change) + swing_mm(change.z), spin_mm_ * change.z};
}

glm::dvec3 BodyMotion::change_for(const glm::dvec3& moved_mm) const {
  const double turn_rad = moved_mm.z / spin_mm_;
  return {glm::dvec2(moved_mm) - swing_mm(turn_rad), turn_rad};
}

BodyWindow body_window(const BoxLogLikelihood& log_likelihood, const PoseLattice& lattice,
                       int object, const Body& body, const BinIndex& centre, double radius_mm) {
  BodyWindow window{.centre = {lattice.x_mm.centre(centre.x), lattice.y_mm.centre(centre.y),
                               lattice.theta_rad.centre(centre.theta)},
                    .bins = {},
                    .largest = -std::numeric_limits<double>::infinity()};
  const BodyMotion motion(body, window.centre);
  const std::vector<BinBox> boxes = boxes_around(lattice, object, body, centre, motion, radius_mm);
  std::vector<BinBox> on_lattice = boxes;
  for (BinBox& box : on_lattice) {
    const int thetas = lattice.theta_rad.count;
    box.theta = (box.theta % thetas + thetas) % thetas;
  }
  const std::vector<double> logs = log_likelihood(on_lattice);
  std::size_t k = 0;
  for (const BinBox& box : boxes) {
    const int theta_steps = box.theta - centre.theta;
    const glm::dvec3 turn(0.0, 0.0, theta_steps * lattice.theta_rad.step());
    const glm::dvec3 turned_mm = motion.by(turn);
    for (int j = 0; j < box.y_count; ++j) {
      for (int i = 0; i < box.x_count; ++i, ++k) {
        const int x_steps = box.x_first + i - centre.x;
        const int y_steps = box.y_first + j - centre.y;
        const glm::dvec3 shift(x_steps * lattice.x_mm.step(), y_steps * lattice.y_mm.step(), 0.0);
        const glm::dvec3 moved_mm = shift + turned_mm;
        const bool neighbour =
            std::abs(x_steps) <= 1 && std::abs(y_steps) <= 1 && std::abs(theta_steps) <= 1;
        const bool within = glm::dot(moved_mm, moved_mm) <= radius_mm * radius_mm;
        if (neighbour || within) {
          window.bins.push_back({shift + turn, moved_mm, logs[k], within});
          window.largest = std::max(window.largest, logs[k]);
        }
      }
    }
  }
  return window;
}

}  // namespace palpate
