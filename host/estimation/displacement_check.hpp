#pragma once

#include <optional>
#include <string>

#include "palpate/displacement.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// The largest standard deviations that a lattice takes: for mm the smaller extent of x and y, for
/// rad the extent of theta. An axis of one bin limits nothing; infinity where no axis does.
DisplacementSd widest_displacement(const PoseLattice& lattice);

/// Throws Error, "<name> mm = ..." or "<name> rad = ...", unless both standard deviations are
/// finite, at least 0 and within widest_displacement().
void validate_displacement(const DisplacementSd& sd, const PoseLattice& lattice, const char* name);

// A lattice does not resolve a displacement where it blurs too little or at the wrong place. Each
// function returns that as a sentence with the remedy, or none where the lattice does resolve it.
// `name` is that of the displacement. An axis of one bin, or a deviation of 0, is not blurred.

/// A standard deviation is below half a step of an axis.
std::optional<std::string> unresolved_by_steps(const DisplacementSd& sd, const PoseLattice& lattice,
                                               const char* name);
/// A step of theta moves the sensor's origin by more than twice the larger of sd.mm and the step of
/// x: |r| theta_step > 2 max(sd.mm, x_step), with r from the pivot to the sensor's origin.
std::optional<std::string> unresolved_at(const Pose& T_robot_sensor, const DisplacementSd& sd,
                                         const PoseLattice& lattice, const char* name);

}  // namespace palpate
