#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "learning/fused_map.hpp"
#include "learning/unposed_maps.hpp"
#include "model/touch_evidence.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/estimate.hpp"

namespace palpate {

/// A press on one of the object's sides: as it is, or mirrored, x to -x in the sensor frame. Its
/// robot frame has the origin in the middle of its contact, and the sensor's axes.
class PressSide {
 public:
  PressSide(const Touch& touch, const ContactModel& contact, bool mirrored);
  PressSide(PressSide&&) = default;
  PressSide& operator=(PressSide&&) = default;

  /// A view into the touch given and, where the press is mirrored, into this object.
  const Touch& touch() const { return touch_; }
  std::span<const TouchEvidence> evidence() const { return {&evidence_, 1}; }
  /// The evidence of its elements In Contact alone.
  std::span<const TouchEvidence> contact() const { return {&contact_, 1}; }
  bool in_contact() const { return evidence_.in_contact(); }
  /// The contact's root mean squared distance from its middle.
  double reach_mm() const { return reach_mm_; }

 private:
  TouchEvidence evidence_;
  TouchEvidence contact_;
  Touch touch_;
  double reach_mm_ = 0.0;
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
  /// @param temperature by which log-likelihoods are divided for PressPlace::certainty:
  /// neighbouring elements are not independent
  PressSearch(const ContactModel& contact, double step_mm, int angles, double temperature);

  /// @param sides the press as it is and, where asked for, mirrored
  PressPlace best_place(const std::vector<PressSide>& sides, const Hypothesis& map) const;

  /// The gain of a press, or a part of one, at any pose, in nats.
  double gain(std::span<const TouchEvidence> press, const Hypothesis& map,
              const Pose& T_object_robot) const;

 private:
  struct Summit;
  struct SideScores;
  Summit climb(const Summit& start) const;
  double certainty_of(const Summit& best, const std::vector<SideScores>& scores) const;

  ContactModel contact_;
  double step_mm_;
  int angles_;
  double temperature_;
};

/// A press with all that does not depend on where it lies.
struct UnposedPress {
  std::size_t index = 0;         ///< into the presses given
  std::vector<PressSide> sides;  ///< as it is and, where asked for, mirrored
  PressImage image;              ///< in the robot frame of the first side
};

/// The map that a press is a part of, and its place there.
struct PressHome {
  std::optional<std::size_t> map;
  PressPlace place;  ///< on the map, or else on the one that it fits best
  double fit = 0.0;  ///< see PlacedPress::fit; 1 where the map is of this press alone
  /// Its contact gains so little, even on the map of this press alone, that the best of all the
  /// places compared may gain as much by chance. Set once all presses are placed.
  bool too_little_contact = false;

  ImagePlace image_place() const;
};

/// Presses on maps.
struct FusedPresses {
  std::vector<PressHome> homes;  ///< [press]
  std::size_t maps = 0;          ///< some may be of no press
  int rounds = 0;                ///< in which every press was placed anew
  bool settled = true;           ///< the last round moved no press
};

/// Assigns presses to maps and places them, as unposed_maps() says. Takes all host threads.
/// @param step_mm of the lattices on which presses are placed
FusedPresses fuse_presses(std::span<const UnposedPress> presses, const UnposedOptions& options,
                          double step_mm, const std::function<void(double)>& progress);

/// How well presses fit maps of one press each: rows are presses, columns the maps. 1: as well
/// as in the press's own map.
struct FitTable {
  std::vector<std::size_t> columns;      ///< the press that each map is of
  std::vector<std::vector<double>> fit;  ///< [press][column]
};

/// The column that as a further map would raise the presses' best fits most, added up; a fit counts
/// from 0 to 1. Columns of presses that fit a map already are left out.
/// @param best [press] fit in the maps that there are, 0 without
/// @param enough fit from which a press needs no further map
/// @returns none where all presses fit
std::optional<std::size_t> next_map(const FitTable& table, std::span<const double> best,
                                    double enough);

}  // namespace palpate
