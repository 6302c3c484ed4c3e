#pragma once

#include <span>
#include <vector>

#include "palpate/pose_histogram.hpp"
#include "recognition/recognition_record.hpp"

namespace palpate::bench {

/// The histogram of a task, which must name one.
PoseHistogram histogram_of(Device& device, const RecognitionTask& task);

/// Estimate and refined pose of a belief beside the truth. Fit and warnings are left out.
RecognitionStep judged_belief(const PoseHistogram& histogram, const RecognitionTask& task,
                              const GroundTruth& truth);

/// The task's belief in one unknown after each of these numbers of touches, which rise. What the
/// histogram believed before is forgotten.
std::vector<RecognitionStep> steps_after(PoseHistogram& histogram, const RecognitionTask& task,
                                         const Recording& trial, std::span<const int> touches);

}  // namespace palpate::bench
