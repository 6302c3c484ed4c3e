#pragma once

#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// One object's belief as a robot sees it: where the origin of T_robot_object lies, and how the
/// object is turned. The window holds every bin with at least a ten thousandth of the likeliest
/// one's share, and is square.
struct PlacedBelief {
  glm::dvec2 lower_mm{0.0};  ///< corner of cell (0, 0) in the robot frame
  double cell_mm = 1.0;      ///< width of a cell, at least that of the lattice's bins
  int cells = 0;             ///< along x and along y
  std::vector<double> xy;    ///< [y, x] probability of a cell, summed over theta
  struct ThetaShare {
    double theta_rad = 0.0;  ///< of T_robot_object, in [-pi, pi)
    double probability = 0.0;
  };
  std::vector<ThetaShare> theta;  ///< one for each theta of the lattice, ascending
};

/// The belief from bins of the object's lattice. A bin with at least a ten thousandth of the belief
/// is divided into 27 equal parts, since it stands for all of its poses.
/// @param bins at least one
PlacedBelief placed_belief(const PoseLattice& lattice, std::span<const BinShare> bins);

}  // namespace palpate
