#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "sweep_point.hpp"

namespace palpate::bench {

struct CostAndError {
  double cost = 0.0;
  double error = 0.0;
};

/// Indices of the entries that no other one beats in one and equals or beats in the other (Pareto),
/// by rising cost. Of equal entries the first one.
std::vector<std::size_t> pareto_front(std::span<const CostAndError> entries);

/// Mean errors of two runs over the trials that both located.
struct PairedErrors {
  int trials = 0;
  double first_mm = 0.0;
  double second_mm = 0.0;
};
/// The runs' trials are those of make_trials(), `objects` letters, of which the run with more
/// trials has more of each. `refined`: of the refined pose in place of the mode's.
PairedErrors paired_errors(const SweepPoint& first, const SweepPoint& second, std::size_t objects,
                           bool refined);

/// What is lost at most, as a part of the finer lattice's mean error, where bins suffice.
inline constexpr double knee_loss = 0.1;

/// Where more bins stop helping, for maps of one cell size: the first run, by rising count, whose
/// mean error exceeds that of no finer one by more than `knee_loss`, over common trials. None where
/// that would be the last one, for want of a finer one to compare with.
std::optional<std::size_t> knee_of(std::span<const SweepPoint> runs, std::size_t objects,
                                   bool refined);

}  // namespace palpate::bench
