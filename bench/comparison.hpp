#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "filter_run.hpp"

namespace palpate::bench {

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
