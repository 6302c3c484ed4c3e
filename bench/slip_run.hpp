#pragma once

#include <cstdint>
#include <vector>

#include "judged_belief.hpp"
#include "palpate/displacement.hpp"
#include "trial_errors.hpp"
#include "trials.hpp"

namespace palpate::bench {

/// An unknown that moves between its touches.
struct SlippingTrial {
  Recording recording;               ///< its `truth` is where the object was at the first touch
  std::vector<Pose> T_object_robot;  ///< [touch]
};

/// A trial whose object takes a step of a random walk before every touch but the first: a turn
/// about its centroid and a translation, of these standard deviations. The walk begins at 3/10 of
/// the trial's distance from the robot frame's origin, within 3 mm along x and y, so that few walks
/// of 50 steps of 0.3 mm leave a region of +-8 mm. The readings stay as they are.
SlippingTrial slipping_trial(const Recording& trial, const glm::dvec2& centroid_mm,
                             const DisplacementSd& step, std::uint64_t seed);

/// Unknowns that slip, as believed with and without HistogramOptions::slip_sd.
struct SlipRun {
  std::vector<PoseErrors> followed;  ///< [touch], over the unknowns
  std::vector<PoseErrors> at_rest;   ///< the same, as if the object rested
};

struct SlipSetting {
  DisplacementSd step;
  PoseLattice lattice;
  int trials_each = 0;  ///< unknowns of every vowel
  int touches = 0;
};

SlipRun run_slip(Device& device, const std::vector<Hypothesis>& letters,
                 const SlipSetting& setting);

/// [unknown] Mean of the mode's error over the touches from index `from` on at which it has the
/// true letter, in mm; none where it never has.
TrialErrors mean_mode_errors(const std::vector<PoseErrors>& errors, std::size_t from = 0);
/// Of all touches of all unknowns, the fraction at which the mode has the true letter.
double located(const std::vector<PoseErrors>& errors);

}  // namespace palpate::bench
