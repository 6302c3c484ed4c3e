#pragma once

#include <vector>

#include "judged_belief.hpp"
#include "trials.hpp"

namespace palpate::bench {

/// What is unknown after each touch of an unknown, by the order in which its touches are made.
struct PlanTrial {
  std::vector<double> random_nats;  ///< [touch] entropy of the belief over objects and bins
  std::vector<double> planned_nats;
  std::vector<double> random_log_loss;  ///< [touch] of the identity, in nats
  std::vector<double> planned_log_loss;
  std::vector<double> plan_seconds;  ///< [plan] time to rank the candidates
};

struct PlanSetting {
  PoseLattice lattice;
  int trials_each = 0;  ///< unknowns of every vowel
  int touches = 0;
};

/// Touches every unknown twice, beginning with the same random touch: in random order, and each
/// time where the most is expected to be told about object and pose. Candidates are the poses of
/// the test set that were not touched yet.
std::vector<PlanTrial> run_plan(Device& device, const std::vector<Hypothesis>& letters,
                                const PlanSetting& setting);

}  // namespace palpate::bench
