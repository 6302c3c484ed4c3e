#pragma once

#include <functional>
#include <span>

#include "palpate/displacement.hpp"
#include "palpate/map_builder.hpp"

namespace palpate {

/// How far the touches of an alignment lie from their reported poses: root mean squares of each
/// axis, over all touches.
struct TouchAlignment {
  DisplacementSd moved;  ///< of the aligned poses
  /// Spread of the true poses by what the touches tell of them: of the aligned poses, with the
  /// posterior's variance. About the standard deviations that were given where these are right.
  DisplacementSd displaced;
  int rounds = 0;  ///< of the object that took most
};

/// Aligns the touches of each object, whose sensor really was at T_robot_sensor * displacement, to
/// the map that they make, and writes their poses. In a round each touch in turn is taken out of
/// the map, put at the posterior mean of its pose (the displacements' prior times Eq. 7 on the map
/// of the others), and added to the map there. The rounds end when touches move by less than a
/// twentieth of a standard deviation (root mean square), after eight at most. After each, the
/// touches are moved together so that no rigid motion of all would bring them nearer to their
/// reported poses. Takes all host threads.
///
/// The map is of a prior of 0.5, which weighs contact and none alike. With a lower one contact
/// weighs more: the map of misplaced touches is wider than the object, and touches that each see
/// one edge would settle there.
/// @param sd of the displacements; where both are 0, no pose changes by a bit
/// @param options of the map; the prior is ignored
/// @throws Error on a touch that is not sound, and as cover() does; what `progress` throws
TouchAlignment align_touches(std::span<ObjectTouches> objects, const DisplacementSd& sd,
                             MapOptions options, const std::function<void(double)>& progress = {});

}  // namespace palpate
