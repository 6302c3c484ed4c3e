#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "trial_errors.hpp"

namespace palpate::bench {

struct CostAndError {
  double cost = 0.0;
  double error = 0.0;
};

/// Indices of the entries on the Pareto front of cost and error, by rising cost; of equal entries,
/// the first.
std::vector<std::size_t> pareto_front(std::span<const CostAndError> entries);

/// Where more bins stop helping: the first of the runs, by rising count, that locates every trial
/// and over which no finer run has a gain(). None where only the last run would do, which no finer
/// run confirms, or where a finer run has no errors.
std::optional<std::size_t> knee_of(std::span<const std::vector<TrialErrors>> runs, PoseKind kind);

}  // namespace palpate::bench
