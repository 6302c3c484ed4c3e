#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "model/random.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// A random number in each of `count` equal parts of [0, 1), ascending. Draws at these parts of a
/// belief have less variance than independent draws.
inline std::vector<double> one_in_each_part(std::size_t count, Random& random) {
  std::vector<double> numbers;
  numbers.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    numbers.push_back((static_cast<double>(i) + random.uniform()) / static_cast<double>(count));
  }
  return numbers;
}

/// T_object_robot of a pose that is uniform within a bin.
inline Pose draw_within(std::int64_t bin, const PoseLattice& lattice, Random& random) {
  const auto within = [&](const Axis& axis, std::int64_t index) {
    return axis.centre(static_cast<int>(index)) + random.uniform(-0.5, 0.5) * axis.step();
  };
  const double x = within(lattice.x_mm, bin % lattice.x_mm.count);
  const double y = within(lattice.y_mm, bin % lattice.plane() / lattice.x_mm.count);
  const double theta = within(lattice.theta_rad, bin / lattice.plane());
  return lattice.T_object_robot(x, y, theta);
}

}  // namespace palpate
