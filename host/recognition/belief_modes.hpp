#pragma once

#include <optional>
#include <span>
#include <vector>

#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "palpate/pose_error.hpp"

namespace palpate {

// Where an object's belief lies, from its bins. Poses are apart by the pose error
// (pose_error_mm()), for which turns that the object's symmetry makes equal are one.

/// What bins are of: poses of an object.
struct BinnedObject {
  PoseLattice lattice;
  Body body;         ///< displaced_body() of its map
  int symmetry = 1;  ///< n-fold; 0 = full
};

/// How far apart two poses are that the window of PoseHistogram::refine() holds together, mm.
inline constexpr double neighbourhood_mm = 2.5;

/// A local peak of an object's belief with the bins about it.
struct BeliefMode {
  int object = 0;            ///< index into the hypotheses
  double probability = 0.0;  ///< summed over its bins
  Pose best;                 ///< T_object_robot of its most probable bin
  /// Mean of T_robot_object over its bins, and their covariance about it, each bin standing for all
  /// of its poses; equal turns are folded onto one, theta lies as least_turned() has it.
  ObjectPose pose;
};

/// The modes of an object's bins.
struct FoundModes {
  std::vector<BeliefMode> modes;     ///< in no order; `object` is left to the caller
  std::vector<std::size_t> mode_of;  ///< [bin] the mode that it is of; modes.size() where of none
};

/// The modes of one object's belief. Bins are gathered
/// in cells of about a millimetre. Cells climb to their densest neighbour, and a peak that stands
/// less than a nat above the saddle to a higher one is part of that peak (ToMATo: Chazal, Guibas,
/// Oudot and Skraba 2013). Cells more than 7 nats below their peak are of no mode: 0.3 % of a
/// Gaussian. Peaks within `neighbourhood_mm` of each other are one mode.
/// @param bins of the lattice, each at most once
FoundModes find_modes(const BinnedObject& of, std::span<const BinShare> bins);

/// A part of a belief, and how far it lies from a pose.
struct PartAway {
  double mm = 0.0;
  double share = 0.0;
};

/// How far the bins lie from a pose.
std::vector<PartAway> parts_away(const BinnedObject& of, std::span<const BinShare> bins,
                                 const Pose& T_object_robot);
/// The parts with those of the neighbourhood spread as the refined pose's covariance says, which
/// bins are too wide to tell.
std::vector<PartAway> spread_between_bins(const BinnedObject& of, std::vector<PartAway> parts,
                                          const RefinedPose& refined);
/// The share that lies within this distance.
double share_within(std::span<const PartAway> parts, double mm);
/// The least distance within which this share lies, mm; none where the parts hold less.
std::optional<double> distance_holding(std::vector<PartAway> parts, double share);

}  // namespace palpate
