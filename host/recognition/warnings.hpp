#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "model/touch_evidence.hpp"
#include "recognition/recogniser.hpp"
#include "recognition/recognition_record.hpp"
#include "recognition/recognition_task.hpp"

namespace palpate {

/// What looks wrong with an unknown's touches, or else with the lattice on which they were
/// evaluated. Each warning is a sentence that names the evidence and the remedy. Touches that look
/// right and lie well within the region give none.
/// @param touches all touches of the unknown so far
/// @param lattice the task's, about the pivot in use
/// @param step what the filter believes after them; its own warnings are not read
std::vector<std::string> warnings_about(std::span<const TouchEvidence> touches,
                                        const RecognitionTask& task, const PoseLattice& lattice,
                                        const RecognitionStep& step);

/// A warning where touches are not where they were said to be, or else none: where the last touches
/// surprise the belief (a mean above `surprising_from`) or all touches together do not fit, and
/// every touch displaced by itself, by up to 4 mm and the turn that belongs to it, makes them fit
/// the object at the step's pose. Names the root mean square of these displacements over the
/// touches in contact. Never for a single touch, nor where "(none)" is best, nor for particles. An
/// unlearned object may be warned of, too: its touches fit pieces of a known one.
/// @param touches all touches of the unknown so far
/// @param step what the filter believes after them; reads mode, pose and fit
/// @param surprises of the touches so far; see SurpriseJudge
std::optional<std::string> touches_contradict(std::span<const TouchEvidence> touches,
                                              const RecognitionTask& task,
                                              const RecognitionStep& step,
                                              std::span<const double> surprises);

/// Mean of the last `surprises_judged` surprises from which they are surprising. Simulated letters:
/// of 620 such means at exact poses none reached 0.9; of those misplaced by 1 mm and 0.05 rad 10 to
/// 25 % exceed 1.5. After 10 touches the warning was given once or more, on 25 x 25 x 16 and
/// 30 x 30 x 113 bins, to 1 of 60 and 0 of 15 unknowns at exact poses, 42 of 60 misplaced by 1 mm,
/// and 59 of 60 and 15 of 15 misplaced by 2 mm and 0.1 rad.
inline constexpr double surprising_from = 1.5;

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
/// What to say where symmetry_told() takes turns as equal that the map does not, or where a known
/// pose error is such a turn; else none.
std::optional<std::string> turned_alike(const RecognitionTask& task, const RecognitionStep& step);

}  // namespace palpate
