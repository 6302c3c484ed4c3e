#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "palpate/lattice.hpp"
#include "palpate/occupancy_grid.hpp"
#include "recognition/recognition_record.hpp"

namespace palpate {

// What a step says of the belief about its pose, whether to act on it, and what looks wrong.

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

/// What looks wrong with an unknown's touches, or else with the lattice on which they were
/// evaluated. Each warning is a sentence that names the evidence and the remedy. Touches that look
/// right and lie well within the region give none.
/// @param touches all touches of the unknown so far
/// @param lattice the task's, about the pivot in use
/// @param step what the filter believes after them; its own warnings are not read
std::vector<std::string> warnings_about(std::span<const TouchEvidence> touches,
                                        const RecognitionTask& task, const PoseLattice& lattice,
                                        const RecognitionStep& step);

/// A learned object explains touches that one pose of it does not, once touches may lie beside the
/// places that the robot says, or the object may have moved between two of them.
struct TouchPlacement {
  int object = 0;  ///< index of the hypothesis
  /// How far each touch lies from where the robot says, by itself; none where the object moved.
  DisplacementSd displaced = {};
  std::size_t moved_after = 0;  ///< last touch before that tells anything, from 1; 0: it lay still
  double moved_mm = 0.0;        ///< by how much, as pose_error_mm() has it
};

/// Judges where the touches lie before a step is believed: where "(none)" is best or the touches do
/// not fit, whether a learned object explains them all the same, at least as well as "(none)" does
/// and fit no worse than doubtfully; where the step would act or the fit is doubtful, whether its
/// object explains them far better. Touches lie up to 2 mm and the turn that belongs to it from
/// where the robot says, each by itself; or the object moved once, after two touches in contact or
/// more and before two or more. Evidence decides, tempered as that of labels, by Laplace's
/// approximation at the peaks that are found near the modes of the five most probable hypotheses.
/// Touches without a known element change nothing.
/// @param step its decision and fit are read
/// @returns none where neither helps, for particles, and where objects slip
std::optional<TouchPlacement> judge_placement(const Recogniser& recogniser,
                                              const Estimate& estimate, const RecognitionTask& task,
                                              const RecognitionStep& step);

struct PlacementWords {
  /// "the touches fit A where each lies some 1.1 mm beside the place that the robot says", or "the
  /// object seems to have moved by 1.1 mm after touch 5".
  std::string finding;
  std::string remedy;
};
PlacementWords words_of(const TouchPlacement& placement, const RecognitionTask& task);

}  // namespace palpate
