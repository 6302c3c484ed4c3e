#include "body_window.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>

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

Range clipped(int centre, int steps, const Axis& axis) {
  const int first = std::max(0, centre - steps);
  return {first, std::min(axis.count - 1, centre + steps) - first + 1};
}

/// As many bins to either side, but no bin of the circle twice.
Range around_circle(int centre, int steps, const Axis& axis) {
  const int before = std::min(steps, (axis.count - 1) / 2);
  const int after = std::min(steps, axis.count / 2);
  return {centre - before, before + after + 1};
}

double spin_mm(const Body& body) { return std::sqrt(std::max(body.inertia_mm2, 1e-12)); }

glm::dvec2 lever_mm(const Body& body, const glm::dvec3& place) {
  return body.centroid_mm - glm::dvec2(place);
}

/// A block of bins that holds the window.
BinWindow block_around(const PoseLattice& lattice, const Body& body, const BinIndex& centre,
                       const glm::dvec3& place, double radius_mm) {
  const int theta_steps = steps_within(radius_mm / spin_mm(body), lattice.theta_rad);
  const Range theta = lattice.full_circle()
                          ? around_circle(centre.theta, theta_steps, lattice.theta_rad)
                          : clipped(centre.theta, theta_steps, lattice.theta_rad);
  const double turn_rad = std::min(theta_steps * lattice.theta_rad.step(), std::numbers::pi);
  const double reach_mm =
      radius_mm + 2.0 * std::sin(turn_rad / 2.0) * glm::length(lever_mm(body, place));
  const Range y = clipped(centre.y, steps_within(reach_mm, lattice.y_mm), lattice.y_mm);
  const Range x = clipped(centre.x, steps_within(reach_mm, lattice.x_mm), lattice.x_mm);
  return {theta.first, theta.count, y.first, y.count, x.first, x.count};
}

}  // namespace

BodyMotion::BodyMotion(const Body& body, const glm::dvec3& place)
    : lever_mm_(lever_mm(body, place)), spin_mm_(spin_mm(body)) {}

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

BodyWindow body_window(const WindowLogLikelihood& log_likelihood, const PoseLattice& lattice,
                       const Body& body, const BinIndex& centre, double radius_mm) {
  BodyWindow window{.centre = {lattice.x_mm.centre(centre.x), lattice.y_mm.centre(centre.y),
                               lattice.theta_rad.centre(centre.theta)},
                    .bins = {},
                    .largest = -std::numeric_limits<double>::infinity()};
  const BinWindow block = block_around(lattice, body, centre, window.centre, radius_mm);
  const std::vector<double> logs = log_likelihood(block);
  const BodyMotion motion(body, window.centre);
  std::size_t k = 0;
  for (int t = 0; t < block.theta_count; ++t) {
    const int theta_steps = block.theta_first + t - centre.theta;
    const glm::dvec3 turn(0.0, 0.0, theta_steps * lattice.theta_rad.step());
    const glm::dvec3 turned_mm = motion.by(turn);
    for (int j = 0; j < block.row_count; ++j) {
      for (int i = 0; i < block.column_count; ++i, ++k) {
        const int x_steps = block.column_first + i - centre.x;
        const int y_steps = block.row_first + j - centre.y;
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
