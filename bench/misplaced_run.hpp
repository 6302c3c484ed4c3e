#pragma once

#include <span>
#include <string>
#include <vector>

#include "judged_belief.hpp"
#include "palpate/displacement.hpp"
#include "trial_errors.hpp"
#include "trials.hpp"

namespace palpate::bench {

/// How well a belief knows its unknowns, and how well it knows that, after some number of touches.
struct BeliefErrors {
  int right = 0;                 ///< unknowns whose most probable letter is the true one
  std::vector<double> log_loss;  ///< [unknown] -log of the true letter's probability, in nats
  PoseErrors pose;               ///< [unknown]
  TrialErrors normalised;        ///< [unknown] see normalised_error(); none where `pose` has none

  void add(const RecognitionTask& task, const RecognitionStep& step);
};

/// Unknowns whose touches lie beside the reported poses, after some number of touches.
struct MisplacedRun {
  int touches = 0;
  BeliefErrors as_if_exact;
  BeliefErrors averaged;  ///< with HistogramOptions::touch_sd

  /// Errors of the refined poses over the unknowns that both beliefs locate.
  struct Paired {
    std::vector<double> as_if_exact_mm;
    std::vector<double> averaged_mm;
  };
  Paired refined() const;
};

struct MisplacedSetting {
  SensorPoseNoise noise;
  PoseLattice lattice;
  int trials_each = 0;  ///< unknowns of every vowel
  std::uint64_t seed = 0;
};

/// The vowels in random poses, touched at random places, after each of these numbers of touches.
/// Both beliefs get the same touches.
std::vector<MisplacedRun> run_misplaced(Device& device, const std::vector<Hypothesis>& letters,
                                        const MisplacedSetting& setting,
                                        std::span<const int> touches);

}  // namespace palpate::bench
