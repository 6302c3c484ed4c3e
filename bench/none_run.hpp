#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "judged_belief.hpp"
#include "measurement.hpp"
#include "palpate/displacement.hpp"
#include "trials.hpp"

namespace palpate::bench {

/// What "none of these" makes of some unknowns after some number of touches.
struct NoneCalls {
  std::vector<double> log_odds;  ///< [unknown] of none against all letters together, in nats
  int called_none = 0;           ///< unknowns for which none is more probable than every letter

  /// Adds the step of a task whose last label is none's.
  void add(const RecognitionStep& step);
  double share_called_none() const;
};

/// Learned and unlearned unknowns after some number of touches.
struct NoneRun {
  int touches = 0;
  NoneCalls learned;
  NoneCalls unlearned;

  /// Of all pairs of a learned and an unlearned unknown, the fraction in which none has the higher
  /// odds for the unlearned one; see told_apart() of values.
  double told_apart() const;
  Interval told_apart_interval() const;
};

struct NoneSetting {
  std::string name;
  PoseLattice lattice;
  TrialTouches touching = {};
  DisplacementSd touch_sd = {};
  int learned_each = 0;    ///< unknowns of every vowel
  int unlearned_each = 0;  ///< and of every shape that was never learned
  bool held_to_goals = false;
};

/// The vowels and shapes that nobody learned (see misfits), after each of these numbers of touches,
/// with "none of these" as likely before the first touch as all letters together.
std::vector<NoneRun> run_none(Device& device, const std::vector<Hypothesis>& letters,
                              const NoneSetting& setting, std::span<const int> touches);

}  // namespace palpate::bench
