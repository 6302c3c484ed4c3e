#include "comparison.hpp"

#include <algorithm>
#include <cstdlib>

#include <fmt/format.h>

namespace palpate::bench {

std::vector<PairedPoint> compare(const FilterRun& first, const FilterRun& second) {
  std::vector<PairedPoint> curve;
  for (std::size_t touch = 0; touch < first.scores.front().size(); ++touch) {
    PairedPoint point{.touches = static_cast<int>(touch) + 1, .error_lead_mm = {}};
    double lead_mm = 0.0;
    for (std::size_t trial = 0; trial < first.scores.size(); ++trial) {
      const Score& a = first.scores[trial][touch];
      const Score& b = second.scores[trial][touch];
      point.right_lead += static_cast<int>(a.right) - static_cast<int>(b.right);
      if (a.error_mm && b.error_mm) {
        ++point.located_by_both;
        lead_mm += *b.error_mm - *a.error_mm;
      }
    }
    if (point.located_by_both > 0) {
      point.error_lead_mm = lead_mm / point.located_by_both;
    }
    curve.push_back(point);
  }
  return curve;
}

bool as_many(std::int64_t a, std::int64_t b) { return 10 * std::abs(a - b) <= std::max(a, b); }

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
