#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "palpate/bounded_posterior.hpp"
#include "press.hpp"

namespace palpate {

/// Where a press lies on a map, and how well it does.
struct PressPlacement {
  Pose T_object_robot;          ///< of the largest likelihood: a bin of the lattice
  double log_likelihood = 0.0;  ///< at that pose, in nats
  /// Log of the likelihood's mean over the lattice, in nats, within `placement_tolerance`.
  double log_evidence = 0.0;
};

/// Share of the likelihood's sum over the lattice that a placement may leave out.
inline constexpr double placement_tolerance = 0.1;

/// Finds the places of presses on one map. Its tables are built once for all presses.
class PressPlacer {
 public:
  /// @param hypothesis with a layer where the contact model has a table over one
  /// @throws Error as BoundedPosterior does
  PressPlacer(Device& device, const Hypothesis& hypothesis, const ContactModel& contact,
              const PoseLattice& lattice);

  /// @throws Error on a touch that is not sound
  PressPlacement place(const Press& press);

 private:
  BoundedPosterior posterior_;
};

/// A lattice for placing presses on each other's maps: T_object_robot over half of the extent of
/// the largest press to either side of the origin, at steps of at most `step_mm`, and all angles at
/// steps of at most `step_rad`.
PoseLattice placing_lattice(std::span<const Press> presses, double step_mm, double step_rad);

}  // namespace palpate
