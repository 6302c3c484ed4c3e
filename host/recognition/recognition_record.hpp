#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "palpate/fit.hpp"
#include "palpate/touch.hpp"
#include "recognition/belief_modes.hpp"
#include "recognition/recogniser.hpp"
#include "recognition/recognition_task.hpp"

namespace palpate {

/// What is known of the truth about an unknown object: perhaps its label, and with it its pose.
struct PartialTruth {
  std::string label;                   ///< "" where it is not known
  std::optional<Pose> T_object_robot;  ///< where it is known
};
/// The truth that a recording or a sensor has, or else the label of the object that it names.
PartialTruth partial_truth(const std::string& object, const std::optional<Truth>& truth);

/// One unknown object: its touches in order, views into memory that the caller keeps alive.
struct Query {
  std::string recording;             ///< file of the touches, or another name
  std::optional<std::size_t> frame;  ///< index in the file where each touch is an unknown
  std::vector<Touch> touches;
  PartialTruth truth;
  std::string error = {};  ///< why the touches are missing, such as a file that cannot be read
};

/// Where a belief lies. Probabilities are those of RecognitionStep::identity, shared among a
/// label's maps by their evidence and among an object's poses by the belief, in which the task's
/// temperature weighs a label's modes as it weighs labels.
struct BeliefPlaces {
  /// At most five, the most probable first, none below 0.001. What they leave of 1 is "(none)",
  /// less probable modes, and poses of no peak. None before the first touch is taken in.
  std::vector<BeliefMode> modes;
  /// Index of the mode that RecognitionStep::mode is of, where it is among them.
  std::optional<std::size_t> own = {};
  double share = 0.0;  ///< probability of poses within `neighbourhood_mm` of pose()
  /// Distance from pose() within which 95 % of the belief lies, mm; none where another object, or
  /// what bounds have not proven, has more than the rest.
  std::optional<double> within_mm = {};
  /// Whether the belief in the pose's object is a nat denser that near pose() than on average, or
  /// lies there by half. Else the refined pose and its deviations are those of bins like others.
  bool peak = true;
};

/// Whether a robot is to act on a result.
struct Decision {
  bool act = false;
  std::string because = {};  ///< a sentence without its full stop
};

/// What the filter believes after a touch.
struct RecognitionStep {
  std::size_t touches = 0;  ///< so far
  /// [label] probability, see label_probabilities(): the sum over the label's maps, after the
  /// task's temperature and features.
  std::vector<double> identity;
  /// [label] bounds of `identity`. Empty where `identity` is exact, and for particles.
  std::vector<ProbabilityInterval> identity_bounds = {};
  std::optional<Certificate> certificate = {};  ///< from a bounded posterior
  std::size_t best = 0;                         ///< index of the label with the largest probability
  Mode mode;
  std::optional<RefinedPose> refined;  ///< empty for particles
  bool contradicted = false;           ///< see Estimate
  PartialTruth truth = {};             ///< in the object frame of the label's map
  /// n-fold symmetry of the mode's object: its map's, or what the map shows
  /// (OccupancyGrid::suggested_symmetry) where touches do not tell such turns apart. Turned poses
  /// are equal, and pose errors ignore such turns.
  int symmetry = 1;
  std::optional<Body> body = {};  ///< of the mode's map; none where no cell is occupied
  /// Whether `best` is the true label, where that label is known. "(none)" is right where no map
  /// has the true label.
  std::optional<bool> right;
  /// Pose error of the mode, mm; see pose_error_mm(). Only where the true pose is known and the
  /// mode's map has the true label, as in Sec. IV, and is no mirror image: the true pose is that of
  /// the object as it was learned.
  std::optional<double> error_mm;
  std::optional<double> refined_error_mm;       ///< pose error of the refined pose, mm
  std::optional<double> effective_sample_size;  ///< of the particles; empty for a histogram
  /// How well `mode.object` at pose() explains all touches so far, also where `best` is "(none)";
  /// averaged over displacements where the task has a touch_sd, and on the task's fit_scale. Empty
  /// where no element of any touch is in contact: an object out of reach explains them.
  std::optional<Fit> fit;
  /// [touch] z of each touch by itself at the refined pose, on the scale of `fit`: which of them
  /// disagrees. None of a touch without a known element. Empty where `fit` is, and for particles.
  std::vector<std::optional<double>> touch_fit = {};
  BeliefPlaces places = {};           ///< where the belief lies, all objects' together
  Decision decision = {};             ///< whether to act on pose()
  std::vector<std::string> warnings;  ///< what looks wrong with the touches, in whole sentences

  double confidence() const { return identity[best]; }
  /// The refined pose, or the mode's where there is none; T_object_robot.
  const Pose& pose() const { return refined ? refined->T_object_robot : mode.T_object_robot; }
  /// The error of pose(), mm.
  std::optional<double> pose_error_mm() const { return refined ? refined_error_mm : error_mm; }
  /// The inverse of pose(), for a robot to act on, turned by least_turned(); theta in [-pi, pi).
  Pose T_robot_object() const;
  /// The inverse of the mode's pose, turned by least_turned(); theta in [-pi, pi).
  Pose mode_T_robot_object() const;
  /// Standard deviations of T_robot_object(), in mm, mm and rad; empty for particles.
  std::optional<std::array<double, 3>> sd() const;
  /// The true T_robot_object, of those that the object's symmetry makes equal the nearest to
  /// T_robot_object(); theta in [-pi, pi). Only where there is an error.
  std::optional<Pose> true_T_robot_object() const;
};

/// The result for one unknown: its steps, or the error that prevented them.
struct RecognitionRecord {
  std::string recording;
  std::optional<std::size_t> frame;
  std::size_t touches = 0;
  std::string true_label;              ///< "" where it is not known
  std::vector<RecognitionStep> trace;  ///< after every touch, or only after the last touch
  double seconds = 0.0;                ///< wall time of the whole trace
  std::string error = {};              ///< "" where there are steps

  const RecognitionStep& last() const { return trace.back(); }
  /// Throws `error` as Error (Fault::input) where there is one.
  void require_steps() const;
};

/// Sums an estimate by label and compares it with the truth, as far as the truth is known.
/// @param touches of the unknown so far, for the task's features and temperature, which is that of
/// one touch where none are given
/// @param refined the refined pose near the estimate's mode
RecognitionStep judge(const Estimate& estimate, const PartialTruth& truth,
                      const RecognitionTask& task, std::span<const TouchEvidence> touches = {},
                      const std::optional<RefinedPose>& refined = {});

/// Updates the belief with more touches of the unknown, then judges the estimate and its refined
/// pose.
/// @param touches those that the recogniser has not yet taken
/// @param tolerance see Recogniser::estimate()
/// @throws Error as Recogniser::update() does
RecognitionStep take_step(Recogniser& recogniser, const RecognitionTask& task,
                          std::span<const Touch> touches, const PartialTruth& truth,
                          const std::function<void(double)>& progress = {},
                          std::optional<double> tolerance = {});

/// Recognises one unknown; what the recogniser believed before is forgotten. Where the unknown is
/// at fault (it has an error or no touches, or a touch is not sound), the record holds the error,
/// and the next unknown can follow.
/// @param trace whether to record a step after every touch instead of only after the last touch;
/// those before the last are within RecognitionTask::trace_tolerance
/// @param progress called now and then with the fraction done
/// @param drawn whether the trace is for a picture of the identity: its steps on which nothing of
/// the last one depends have no more than this, within RecognitionTask::drawn_tolerance
/// @throws Error (Fault::system) if the device fails; what `progress` throws
RecognitionRecord recognise(Recogniser& recogniser, const RecognitionTask& task,
                            const Query& unknown, bool trace,
                            const std::function<void(double)>& progress = {}, bool drawn = false);

}  // namespace palpate
