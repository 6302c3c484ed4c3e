#pragma once

#include <vector>

#include "learning/press_side.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// The best place of a press on a map.
struct PressPlace {
  Pose T_object_robot;  ///< of the robot frame of the side on which the press lies
  bool mirrored = false;
  /// Log-likelihood of the press's readings here minus that far beyond the map, in nats.
  double gain = 0.0;
  /// Posterior probability, with tempered likelihoods, of the places at which the press's contact
  /// lies within two steps (root mean square) of this one.
  double certainty = 0.0;
  double log_places = 0.0;  ///< log of the number of places that were compared
};

/// Finds the best pose of presses on a map. PressPlacer compares all poses of a lattice that bring
/// the middle of the press's contact into the box around the map's occupied cells, or beside it by
/// up to half of the contact's reach; the search then climbs from the best of them.
class PressSearch {
 public:
  /// @param contact with its prior
  /// @param temperature by which log-likelihoods are divided for PressPlace::certainty:
  /// neighbouring elements are not independent
  PressSearch(const ContactModel& contact, double step_mm, int angles, double temperature);

  /// @param sides as the press is and, where asked for, mirrored
  PressPlace best_place(const std::vector<PressSide>& sides, const Hypothesis& map) const;

  /// The gain of a press, or a part of one, at any pose, in nats.
  double gain(const Press& press, const Hypothesis& map, const Pose& T_object_robot) const;

 private:
  struct Summit;
  struct SideScores;
  PoseLattice lattice_for(const PressSide& side, const Hypothesis& map) const;
  Summit climb(const Summit& start) const;
  double certainty_of(const Summit& best, const std::vector<SideScores>& scores) const;

  ContactModel contact_;
  double step_mm_;
  int angles_;
  double temperature_;
};

}  // namespace palpate
