#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "palpate/touch.hpp"
#include "recogniser.hpp"
#include "recognition_task.hpp"

namespace palpate {

/// What is known of an unknown, for judging what it is recognised as.
struct GroundTruth {
  std::string label;                   ///< "" where it is not known
  std::optional<Pose> T_object_robot;  ///< where it is known
};
/// The truth of a recording or a sensor, or else the object that it names.
GroundTruth ground_truth(const std::string& object, const std::optional<Truth>& truth);

/// One unknown object: touches in order, views into memory that the caller keeps alive.
struct Unknown {
  std::string recording;             ///< the file, or another name
  std::optional<std::size_t> frame;  ///< index in the file, where each touch is an unknown
  std::vector<Touch> touches;
  GroundTruth truth;
  std::string error = {};  ///< why there are no touches, such as a file that cannot be read
};
/// All touches of a recording.
Unknown unknown_of(const Recording& recording);

/// The unknowns are presses, one by one, of one large array that stays where it is: they share most
/// of the work, see HistogramOptions::still_array.
bool array_is_still(std::span<const Unknown> unknowns);

/// What is believed after a touch.
struct RecognitionStep {
  std::vector<double> identity;  ///< [label] probability, summed over the maps of the label
  std::size_t best = 0;          ///< the label of the largest probability
  Mode mode;
  std::optional<RefinedPose> refined;  ///< where the filter has bins
  bool contradicted = false;
  /// Is `best` the true label, where that is known? "(none)" is right where no map has that label.
  std::optional<bool> right;
  /// Of the mode's pose in mm (pose_error_mm()), where the truth is known and the mode's object is
  /// the true one, as in Sec. IV.
  std::optional<double> error_mm;
  std::optional<double> refined_error_mm;       ///< the same of the refined pose
  std::optional<double> effective_sample_size;  ///< of the particles, where there are any

  /// Probability of `best`.
  double confidence() const { return identity[best]; }
};

/// The result for one unknown: its steps, or why there are none.
struct RecognitionRecord {
  std::string recording;
  std::optional<std::size_t> frame;
  std::size_t touches = 0;
  std::string true_label;              ///< "" where it is unknown
  std::vector<RecognitionStep> trace;  ///< after every touch, or only after the last one
  double seconds = 0.0;                ///< wall time, estimates included
  std::string error = {};              ///< "" where there are steps

  const RecognitionStep& last() const { return trace.back(); }
  /// Throws the error, where there is one, as Error (Fault::input).
  void require_steps() const;
};

/// An estimate beside the truth, as far as it is known.
RecognitionStep judge(const Estimate& estimate, const GroundTruth& truth,
                      const RecognitionTask& task);
/// Adds the refined pose of the step's mode.
void add_refined(const RefinedPose& refined, const GroundTruth& truth, const RecognitionTask& task,
                 RecognitionStep& step);
/// What the recogniser believes now, with all that its filter has to say.
RecognitionStep judge(const Recogniser& recogniser, const GroundTruth& truth,
                      const RecognitionTask& task);

/// Recognises one unknown, whatever was recognised before it. A fault of the unknown, such as a
/// touch that is not sound, no touches or Unknown::error, is the record's error and leaves the
/// recogniser ready for the next unknown.
/// @param trace a step after every touch, not only after the last one
/// @param progress called with the fraction done, now and then
/// @throws Error (Fault::system) if the device fails; what `progress` throws
RecognitionRecord recognise(Recogniser& recogniser, const RecognitionTask& task,
                            const Unknown& unknown, bool trace,
                            const std::function<void(double)>& progress = {});

}  // namespace palpate
