#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "measurement.hpp"
#include "recognition/recognition_record.hpp"
#include "trial_errors.hpp"

namespace palpate::bench {

/// What one filter made of all trials.
struct FilterRun {
  std::string filter;      ///< "histogram", "bounds", "particles", "systematic" or "augmented"
  std::string name;        ///< with its size, such as "histogram 25x25x16"
  std::int64_t count = 0;  ///< bins per object, or particles in all
  std::vector<RecognitionRecord> records;  ///< [trial]
  double seconds = 0.0;                    ///< wall time of all trials
  std::string path;                        ///< how the likelihood is evaluated
  std::uint64_t device_bytes = 0;          ///< most device memory held
  std::uint64_t host_bytes = 0;            ///< most memory that bounds held
};

/// All unknowns by the task's filter. Of particles, unknown i has the task's seed + i.
/// @param trace whether the records have a step after every touch, or only after the last one
FilterRun run_filter(Device& device, RecognitionTask task, std::span<const Unknown> unknowns,
                     bool trace);
/// The same of trials, with a step after every touch.
FilterRun run_filter(Device& device, RecognitionTask task, std::span<const Recording> trials);

/// A run after some number of touches, over all trials.
struct CurvePoint {
  int touches = 0;
  double accuracy = 0.0;  ///< fraction of the trials whose most probable object is the true one
  Interval accuracy_interval;  ///< 95 %, see wilson_interval()
  double mean_confidence = 0.0;
  int located = 0;  ///< trials whose mode's object is the true one; the errors are over these
  std::optional<ErrorsOverTrials> error;          ///< none where nothing is located
  std::optional<ErrorsOverTrials> refined_error;  ///< none of particles, too
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

/// One filter against another over the same trials, after some number of touches.
struct PairedPoint {
  int touches = 0;
  int right_lead = 0;  ///< trials that the first filter has right, minus those of the second
  int located_by_both = 0;
  /// Mean error of the second filter minus the mean error of the first, over the trials that both
  /// locate: errors over its own trials would flatter the filter that loses the hard ones. None
  /// where no trial is located by both.
  std::optional<double> error_lead_mm;
  std::optional<Interval> error_lead_interval;  ///< 95 %; none of fewer than three such trials
};
/// After 1, 2, ... touches. Both runs are of the same trials and touches.
std::vector<PairedPoint> compare(const FilterRun& first, const FilterRun& second);

/// Whether two counts agree within a tenth: whole numbers of balanced bins along each axis rarely
/// multiply to a given count.
bool as_many(std::int64_t a, std::int64_t b);

struct EqualCount {
  const FilterRun& histogram;
  const FilterRun& particles;
};
/// All pairs of a histogram and a particle filter with as many particles as the histogram has bins
/// per object. The pairs refer to the runs.
std::vector<EqualCount> equal_counts(const std::vector<FilterRun>& runs);

/// Touch counts in order, such as "1-4, 8".
std::string ranges_of(const std::vector<int>& touches);

}  // namespace palpate::bench
