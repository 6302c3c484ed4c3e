#pragma once

#include <span>
#include <vector>

#include "learning/local_search.hpp"
#include "model/touch_evidence.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/estimate.hpp"
#include "palpate/pose.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// A press on one of the object's sides: as it is, or mirrored, x to -x in the sensor frame. Its
/// robot frame has the origin in the middle of its contact, and the sensor's axes.
struct PressSide {
  PressSide(const Touch& given, const ContactModel& model, bool mirrored);
  PressSide(PressSide&&) = default;
  PressSide& operator=(PressSide&&) = default;

  std::vector<TouchEvidence> evidence;  ///< of the one touch
  std::vector<TouchEvidence> contact;   ///< of its elements In Contact alone
  Touch touch;  ///< a view into the touch given and, where the press is mirrored, into `evidence`
  double reach_mm = 0.0;  ///< the contact's root mean squared distance from its middle
};

/// The root mean squared displacement in mm of a press's contact between two poses.
double displacement_mm(const PressSide& press, const Pose& T_object_robot, const Pose& other);

/// The best place of a press on a map.
struct PressPlace {
  Pose T_object_robot;  ///< of the robot frame of the side on which the press lies
  bool mirrored = false;
  /// Log-likelihood of the press's readings here minus their log-likelihood far beyond the map, in
  /// nats.
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
  /// @param reach_mm the largest of the presses' contacts
  /// @param temperature by which log-likelihoods are divided for PressPlace::certainty:
  /// neighbouring elements are not independent
  PressSearch(const ContactModel& contact, double step_mm, double reach_mm, double temperature);

  /// @param sides the press as it is and, where asked for, mirrored
  PressPlace best_place(const std::vector<PressSide>& sides, const Hypothesis& map) const;

  /// The gain of a press, or a part of one, at any pose, in nats.
  double gain(std::span<const TouchEvidence> press, const Hypothesis& map,
              const Pose& T_object_robot) const;

 private:
  struct SideScores;

  double certainty_of(const Pose& best, const SideScores& on,
                      const std::vector<SideScores>& scores) const;

  ContactModel contact_;
  double step_mm_;
  int angles_ = 0;
  double temperature_;
};

}  // namespace palpate
