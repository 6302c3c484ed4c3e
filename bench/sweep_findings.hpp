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

/// Indices of the entries that no other one beats in one and equals or beats in the other (Pareto),
/// by rising cost. Of equal entries the first one.
std::vector<std::size_t> pareto_front(std::span<const CostAndError> entries);

/// Where more bins stop helping: the first run, by rising count, that locates every trial and over
/// which no finer one has a gain(). None where that would be the last one, for want of a finer one
/// to compare with, or where a run has no errors.
std::optional<std::size_t> knee_of(std::span<const std::vector<TrialErrors>> runs, PoseKind kind);

}  // namespace palpate::bench
