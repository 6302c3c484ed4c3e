#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "recogniser.hpp"
#include "recognition_task.hpp"

namespace palpate::cli {

/// What was believed after a touch.
struct Step {
  std::vector<double> identity;  ///< [label] probability
  std::size_t best = 0;          ///< the label of the largest probability
  Mode mode;
  std::optional<RefinedPose> refined;  ///< where the filter has bins
  bool contradicted = false;
  /// Is `best` the true label, where that is known? "(none)" is right where no map has that label.
  std::optional<bool> right;
  std::optional<double> error_mm;  ///< of the mode, where the truth is known and its object right
  std::optional<double> refined_error_mm;
  std::optional<double> effective_sample_size;  ///< of the particles, where there are any
};

/// The result for one unknown.
struct RecognitionRecord {
  std::string recording;
  std::optional<std::size_t> frame;
  std::size_t touches = 0;
  std::string true_label;   ///< "" where it is unknown
  std::vector<Step> trace;  ///< after every touch, or only after the last one
  double seconds = 0.0;

  const Step& last() const { return trace.back(); }
};

/// What is believed now, summed over the maps of each label and compared with the truth, as far as
/// it is known: a label, "" where not, and a pose.
Step judge(const Recogniser& recogniser, const std::string& true_label,
           const std::optional<Truth>& truth, const RecognitionTask& task);

/// The label that the recording is known to show: its truth, or else its object.
const std::string& true_label(const Recording& recording);

/// One step in the form that other programs rely on.
nlohmann::ordered_json to_json(const Step& step, const RecognitionTask& task);
/// The record in the form that other programs rely on.
nlohmann::ordered_json to_json(const RecognitionRecord& record, const RecognitionTask& task,
                               const std::string& device, bool with_trace);

/// "A.h5", or "A.h5 frame 3".
std::string name_of(const RecognitionRecord& record);

/// The trace touch by touch, for people.
void print_trace(const RecognitionRecord& record, const RecognitionTask& task);
/// The table of all unknowns; with known truths also how many are right, the pose error and what
/// was taken for what.
void print_table(const std::vector<RecognitionRecord>& records, const RecognitionTask& task);

}  // namespace palpate::cli
