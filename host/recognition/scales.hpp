#pragma once

#include <optional>
#include <span>
#include <string>

#include "model/touch_evidence.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "palpate/pose_error.hpp"
#include "recognition/recognition_task.hpp"

namespace palpate {

/// Whether no axis of the lattice has bins more than `wider` times as wide as the maps resolve.
/// @param near_mm reach of the arrays, where the pivot lies at a touch: an object then turns about
/// a place near it. Otherwise it may turn about any place of the region.
bool resolves(const PoseLattice& lattice, std::span<const Hypothesis> hypotheses, double wider,
              std::optional<double> near_mm);

/// Scales of what recognition says.
struct Scales {
  FitScale fit = {};    ///< LearnedSensor::fit_scale
  PoseScale pose = {};  ///< LearnedSensor::pose_scale
};
/// Those of the maps' own touches that were left out. That maps are off counts whatever judges.
/// @param near_mm see resolves()
Scales scales_of_maps(const RecognitionTask& task, std::optional<double> near_mm);

/// What is left out where the lattice would resolve the maps if the pivot lay at a touch, and does
/// not, and the remedy; else "".
/// @param without_none "(none)" is left out for its bins
std::string far_pivot_sentence(const RecognitionTask& task, double reach_mm, bool without_none);

/// What to say where the task's bins are more than 1.5 times as wide as those of the sensor model;
/// "" elsewhere.
std::string wider_bins_sentence(const RecognitionTask& task);

/// What widens a belief beside its touches' readings: variances summed over the axes of the body's
/// motion, as spread_mm() sums them.
struct MotionVariances {
  double displacement_mm2 = 0.0;  ///< of a touch's array
  double slip_mm2 = 0.0;          ///< of the body between two touches
  int touches = 0;
};
/// The factor of the belief's variance where that of each touch's readings has `factor`, since what
/// displacement and slips add is known and stays: `factor` itself without these, 1 where they are
/// all that the belief's variance is made of. The belief is taken for a Kalman filter's along one
/// axis, all readings for equally good.
double belief_factor(double factor, double variance_mm2, const MotionVariances& known);

/// The pose with its covariance on the task's scale.
/// @param touches those of the belief
ObjectPose on_scale(const RecognitionTask& task, std::span<const TouchEvidence> touches,
                    const Body& body, const ObjectPose& pose);
RefinedPose on_scale(const RecognitionTask& task, std::span<const TouchEvidence> touches,
                     const Body& body, const RefinedPose& pose);

}  // namespace palpate
