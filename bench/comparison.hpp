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
  int right_lead = 0;  ///< trials that the first has right, less those of the second
  int located_by_both = 0;
  /// Mean error of the second less that of the first, over the trials that both locate: a filter
  /// that loses the hard trials would gain by errors over its own. None where there are none.
  std::optional<double> error_lead_mm;
  std::optional<Interval> error_lead_interval;  ///< 95 %; none where there are less than two
};
/// After 1, 2, ... touches. Both runs are of the same trials and touches.
std::vector<PairedPoint> compare(const FilterRun& first, const FilterRun& second);

/// Within a tenth: balanced bins are as many as their whole numbers along each axis allow.
bool as_many(std::int64_t a, std::int64_t b);

struct EqualCount {
  const FilterRun& histogram;
  const FilterRun& particles;
};
/// Every histogram with all particle filters that are as many as its bins per object. The runs
/// outlive what is returned.
std::vector<EqualCount> equal_counts(const std::vector<FilterRun>& runs);

/// Touch counts in order, such as "1-4, 8".
std::string ranges_of(const std::vector<int>& touches);

}  // namespace palpate::bench
