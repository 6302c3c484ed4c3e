#include "sweep_findings.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

namespace palpate::bench {

std::vector<std::size_t> pareto_front(std::span<const CostAndError> entries) {
  std::vector<std::size_t> order(entries.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return entries[a].cost != entries[b].cost ? entries[a].cost < entries[b].cost
                                              : entries[a].error < entries[b].error;
  });
  std::vector<std::size_t> front;
  double least = std::numeric_limits<double>::infinity();
  for (const std::size_t i : order) {
    if (entries[i].error < least) {
      least = entries[i].error;
      front.push_back(i);
    }
  }
  return front;
}

PairedErrors paired_errors(const SweepPoint& first, const SweepPoint& second, std::size_t objects,
                           bool refined) {
  const std::size_t first_each = first.scores.size() / objects;
  const std::size_t second_each = second.scores.size() / objects;
  PairedErrors paired;
  for (std::size_t object = 0; object < objects; ++object) {
    for (std::size_t i = 0; i < std::min(first_each, second_each); ++i) {
      const Score& a = first.scores[object * first_each + i];
      const Score& b = second.scores[object * second_each + i];
      const std::optional<double>& a_mm = refined ? a.refined_error_mm : a.error_mm;
      const std::optional<double>& b_mm = refined ? b.refined_error_mm : b.error_mm;
      if (a_mm && b_mm) {
        ++paired.trials;
        paired.first_mm += *a_mm;
        paired.second_mm += *b_mm;
      }
    }
  }
  if (paired.trials > 0) {
    paired.first_mm /= paired.trials;
    paired.second_mm /= paired.trials;
  }
  return paired;
}

std::optional<std::size_t> knee_of(std::span<const SweepPoint> runs, std::size_t objects,
                                   bool refined) {
  for (std::size_t i = 0; i + 1 < runs.size(); ++i) {
    const bool suffices = std::all_of(
        runs.begin() + static_cast<std::ptrdiff_t>(i), runs.end(), [&](const SweepPoint& finer) {
          const PairedErrors paired = paired_errors(runs[i], finer, objects, refined);
          return paired.trials > 0 && paired.first_mm <= (1.0 + knee_loss) * paired.second_mm;
        });
    if (suffices) {
      return i;
    }
  }
  return {};
}

}  // namespace palpate::bench
