#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "measurement.hpp"
#include "recognition_record.hpp"

namespace palpate::bench {

/// What one filter made of all trials.
struct FilterRun {
  std::string filter;      ///< "histogram", "particles", "systematic" or "augmented"
  std::string name;        ///< with its size, such as "histogram 25x25x16"
  std::int64_t count = 0;  ///< bins per object, or particles in all
  std::vector<RecognitionRecord> records;  ///< [trial], with a step after every touch
  double seconds = 0.0;                    ///< wall time of all trials
  std::string path;                        ///< how the likelihood is evaluated
  std::uint64_t device_bytes = 0;          ///< most device memory held
};

/// All trials by the task's filter. Of particles, trial i has the task's seed + i.
FilterRun run_filter(Device& device, RecognitionTask task, std::span<const Recording> trials);

/// Mean, median and 95th percentile.
struct ErrorSummary {
  double mean_mm = 0.0;
  double median_mm = 0.0;
  double p95_mm = 0.0;
};

/// A run after some number of touches, over all trials.
struct CurvePoint {
  int touches = 0;
  double accuracy = 0.0;  ///< fraction of the trials whose most probable object is the true one
  Interval accuracy_interval;  ///< 95 %, see wilson_interval()
  double mean_confidence = 0.0;
  int located = 0;  ///< trials whose mode's object is the true one; the errors are over these
  std::optional<ErrorSummary> error;          ///< none where nothing is located
  std::optional<ErrorSummary> refined_error;  ///< none where the filter has no refined pose, too
};
/// After 1, 2, ... touches.
std::vector<CurvePoint> curve_of(const FilterRun& run);

/// How far the probability of the most probable object can be taken at its word, over all trials
/// and touches.
struct Calibration {
  struct Bin {
    double lower = 0.0;  ///< of the confidences in it; the upper end is the next bin's lower
    int count = 0;
    double mean_confidence = 0.0;
    double fraction_right = 0.0;
  };
  std::vector<Bin> bins;  ///< ten of equal width over [0, 1], the empty ones left out
  /// Mean distance between confidence and fraction right, bins weighted by their counts (Naeini,
  /// Cooper and Hauskrecht 2015).
  double expected_error = 0.0;
};
Calibration calibration_of(const FilterRun& run);

}  // namespace palpate::bench
