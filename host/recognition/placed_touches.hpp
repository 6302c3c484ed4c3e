#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <span>
#include <vector>

#include "model/map_likelihood.hpp"
#include "model/touch_evidence.hpp"
#include "palpate/lattice.hpp"
#include "recognition/recognition_task.hpp"

namespace palpate {

/// Some touches of an unknown, one after another.
struct TouchRange {
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// A pose that explains touches better than those about it.
struct PlacedPeak {
  Pose T_object_robot;
  double nats = 0.0;  ///< log-likelihood of the touches there
};

/// [x, y, theta][touch] log-likelihoods that climbs of some touches left to others; or NaN.
using KnownNats = std::map<std::array<double, 3>, std::vector<double>>;

/// The likelihood of an unknown's touches on one object about a pose, where every touch may lie
/// beside the place that the robot says, each by itself.
class PlacedTouches {
 public:
  /// @param touches outlive this object
  /// @param object index of the task's hypothesis
  /// @param region in which poses lie; an axis of no width stays
  PlacedTouches(std::span<const TouchEvidence> touches, const RecognitionTask& task,
                std::size_t object, const PoseLattice& region);

  /// Sum over the touches of the log of the mean likelihood over the displacements.
  /// @param displacements equally likely, at least one
  double log_likelihood(const Pose& T_object_robot, std::span<const Pose> displacements,
                        TouchRange range) const;
  /// Climbs from a pose in steps along x, y and theta that halve from `first_mm` on, a turn as far
  /// as it moves the object.
  /// @param known of the same displacements, for climbs that come by the same poses
  PlacedPeak climb(const Pose& from, std::span<const Pose> displacements, TouchRange range,
                   double first_mm, KnownNats* known = nullptr) const;
  /// Log of the volume under a peak over its height, in mm^2 rad, by the curvature there (Laplace);
  /// axes that stay have none.
  double log_volume(const PlacedPeak& peak, std::span<const Pose> displacements,
                    TouchRange range) const;
  /// How far the touches in contact lie from where the robot says, by the displacements' posterior
  /// at this pose: the standard deviation along x and y, mm.
  double displaced_mm(const Pose& T_object_robot, std::span<const Pose> displacements,
                      TouchRange range) const;

 private:
  /// Writes the log-likelihood of a touch at each displacement; returns the largest.
  double evaluate(const TouchEvidence& touch, const Pose& T_object_robot,
                  std::span<const Pose> displacements, std::span<double> nats) const;
  /// The pose after a shift of the touches' middle in the object frame, mm, and a turn about it, as
  /// far as the region's axes do not stay.
  Pose moved(const Pose& T_object_robot, const glm::dvec2& shift_mm, double turn_rad) const;

  std::span<const TouchEvidence> touches_;
  MapLikelihood likelihood_;
  PoseLattice region_;
  glm::dvec2 middle_mm_{0.0};  ///< of the arrays, in the robot frame
  double rad_per_mm_ = 0.0;    ///< turn that moves the object by 1 mm, root mean square
};

}  // namespace palpate
