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

// Rules about the touches of an unknown. Each rule returns a warning (see warnings_about()), or
// none where the touches look right. There is at least one touch.

/// The sensor's positions look like metres.
std::optional<std::string> positions_in_metres(std::span<const TouchEvidence> touches);
/// The sensor's angles look like degrees.
std::optional<std::string> angles_in_degrees(std::span<const TouchEvidence> touches);
/// The array and a map have scales that do not fit together.
std::optional<std::string> other_scale(std::span<const TouchEvidence> touches,
                                       const RecognitionTask& task);
/// The threshold leaves no element known, or the touches tell nothing, since no element was ever in
/// contact or all were.
std::optional<std::string> nothing_felt(std::span<const TouchEvidence> touches, double threshold);
/// No pose of the region brings most of the touches that have an element In Contact to any map.
std::optional<std::string> out_of_reach(std::span<const TouchEvidence> touches,
                                        const RecognitionTask& task, const PoseLattice& region);

/// The touches, from 0, that disagree where all others fit the mode's object at the pose: by
/// touch_fit, a third of them at most, and the others are three or more in contact. Else none.
std::vector<std::size_t> unlike_touches(std::span<const TouchEvidence> touches,
                                        const RecognitionTask& task, const RecognitionStep& step);
/// What to say of these touches.
std::string unlike_words(std::span<const std::size_t> unlike, const RecognitionTask& task,
                         const RecognitionStep& step);

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
