#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "model/cell_range.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/pose.hpp"
#include "palpate/touch.hpp"

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

/// The log odds of an object's touches (Eq. 4-6), each reading's within 1e-3 nats. A touch can be
/// taken out, so that the map of the others predicts it, and be put back, there or elsewhere.
class PredictiveMap {
 public:
  /// The map of all touches. It covers what they sense; what a touch that is put elsewhere senses
  /// beyond is lost.
  /// @param options with the prior
  /// @throws Error on a touch that is not sound, and as cover() does
  PredictiveMap(std::span<const Touch> touches, const MapOptions& options);

  void take_out(std::size_t touch) { add(touch, -1.0); }
  void put_in(std::size_t touch, const Pose& T_robot_sensor);
  /// Log-likelihood (Eq. 7) of the touch's readings at this pose, in nats.
  double log_likelihood(std::size_t touch, const Pose& T_robot_sensor) const;

 private:
  void add(std::size_t touch, double times);
  double increment(Reading reading, double squared_mm) const;
  double log_odds(const glm::dvec2& p_robot_mm) const;

  MapOptions options_;
  ContactModel contact_;
  std::vector<std::vector<ElementReading>> known_;  ///< [touch] in the sensor frame
  std::vector<Pose> T_robot_sensor_;                ///< [touch] where it is, or was, in the map
  double radius_mm_ = 0.0;
  /// [contact or none] nats at equally spaced squares of the distance, up to the radius's.
  std::array<std::vector<double>, 2> increments_;
  CellRange cells_;
  std::vector<double> log_odds_;  ///< of cells_, [ny, nx]
};

}  // namespace palpate
