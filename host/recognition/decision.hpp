#pragma once

#include <span>

#include "palpate/lattice.hpp"
#include "palpate/occupancy_grid.hpp"
#include "recognition/recognition_record.hpp"

namespace palpate {

// What a step says of the belief about its pose, and whether to act on it.

/// The n-fold symmetry of the mode's object as far as touches tell: its map's, or where that is 1
/// and the belief spreads over turns after which the map looks the same, the one that the map shows
/// (OccupancyGrid::suggested_symmetry).
int symmetry_told(const Recogniser& recogniser, const RecognitionTask& task,
                  const RecognitionStep& step);
/// The same of an object's map and its belief.
/// @param shares [theta] of the belief, at the centres of the axis
/// @param own_rad the most probable theta
/// @param temperature by which turns weigh, see LearnedSensor
int symmetry_told(const OccupancyGrid& map, const Axis& theta, std::span<const double> shares,
                  double own_rad, double temperature);

/// Where the belief lies about the step's pose.
BeliefPlaces places_of(const Recogniser& recogniser, const Estimate& estimate,
                       const RecognitionTask& task, const RecognitionStep& step);

/// Acts where `best` is a learned object with at least the task's `act.above`, `fit` is not
/// Verdict::does_not_fit, and 95 % of the belief lies within `act.below_mm` of pose(). By bounds it
/// is the lower bound of the probability that counts. Else says which of them is not so.
Decision decide(const RecognitionStep& step, const RecognitionTask& task);

}  // namespace palpate
