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

std::optional<std::size_t> knee_of(std::span<const std::vector<TrialErrors>> runs, PoseKind kind) {
  for (std::size_t i = 0; i + 1 < runs.size(); ++i) {
    const auto finer = runs.subspan(i + 1);
    const bool all_located = std::all_of(runs[i].begin(), runs[i].end(), [&](const auto& trial) {
      return trial.of(kind).has_value();
    });
    const bool suffices =
        all_located &&
        std::all_of(finer.begin(), finer.end(), [&](const std::vector<TrialErrors>& run) {
          const PairedErrors paired = paired_errors(runs[i], run, kind);
          return paired.trials > 0 && !paired.gain();
        });
    if (suffices) {
      return i;
    }
  }
  return {};
}

}  // namespace palpate::bench
