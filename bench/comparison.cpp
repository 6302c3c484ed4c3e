#include "comparison.hpp"

#include <algorithm>
#include <cstdlib>
#include <numeric>

#include <fmt/format.h>

namespace palpate::bench {

std::vector<PairedPoint> compare(const FilterRun& first, const FilterRun& second) {
  std::vector<PairedPoint> curve;
  for (std::size_t touch = 0; touch < first.records.front().trace.size(); ++touch) {
    PairedPoint point{
        .touches = static_cast<int>(touch) + 1, .error_lead_mm = {}, .error_lead_interval = {}};
    std::vector<double> leads_mm;
    for (std::size_t trial = 0; trial < first.records.size(); ++trial) {
      const RecognitionStep& a = first.records[trial].trace[touch];
      const RecognitionStep& b = second.records[trial].trace[touch];
      point.right_lead += static_cast<int>(*a.right) - static_cast<int>(*b.right);
      if (a.error_mm && b.error_mm) {
        leads_mm.push_back(*b.error_mm - *a.error_mm);
      }
    }
    point.located_by_both = static_cast<int>(leads_mm.size());
    if (!leads_mm.empty()) {
      point.error_lead_mm =
          std::accumulate(leads_mm.begin(), leads_mm.end(), 0.0) / point.located_by_both;
    }
    if (leads_mm.size() > 2) {
      point.error_lead_interval = mean_interval(leads_mm);
    }
    curve.push_back(point);
  }
  return curve;
}

bool as_many(std::int64_t a, std::int64_t b) { return 10 * std::abs(a - b) <= std::max(a, b); }

std::vector<EqualCount> equal_counts(const std::vector<FilterRun>& runs) {
  std::vector<EqualCount> pairs;
  for (const FilterRun& particles : runs) {
    for (const FilterRun& histogram : runs) {
      if (particles.filter != "histogram" && histogram.filter == "histogram" &&
          as_many(histogram.count, particles.count)) {
        pairs.push_back({histogram, particles});
      }
    }
  }
  return pairs;
}

std::string ranges_of(const std::vector<int>& touches) {
  std::string text;
  for (std::size_t begin = 0; begin < touches.size();) {
    std::size_t end = begin + 1;
    while (end < touches.size() && touches[end] == touches[end - 1] + 1) {
      ++end;
    }
    text += text.empty() ? "" : ", ";
    text += end - begin == 1 ? fmt::format("{}", touches[begin])
                             : fmt::format("{}-{}", touches[begin], touches[end - 1]);
    begin = end;
  }
  return text;
}

}  // namespace palpate::bench
