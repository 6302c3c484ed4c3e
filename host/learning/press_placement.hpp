#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "learning/press.hpp"
#include "model/map_likelihood.hpp"
#include "model/touch_evidence.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "palpate/pose.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// Where a press lies on a map, and how well it does.
struct PressPlacement {
  Pose T_object_robot;          ///< of the largest likelihood: a bin of the lattice
  double log_likelihood = 0.0;  ///< at that pose, in nats
  double log_evidence = 0.0;    ///< log of the likelihood's mean over the lattice, in nats
};

/// Finds the places of presses on one map, over all bins of a lattice. A press is given by the
/// evidence of its touches, classified by the contact model.
///
/// Each reading's log-likelihood is tabulated at samples of the map that divide the lattice's
/// steps, so that an element adds rows of the table to rows of bins. An element takes the nearest
/// sample, at most half a cell of the map away along each axis; the best bins by these sums are
/// then evaluated at the elements' own places. No Contact everywhere is summed once for all presses
/// of one array at one place. Eq. 7 is read from a table, see tabulated(). Takes all host threads;
/// not thread-safe, but several placers may work side by side.
class PressPlacer {
 public:
  /// @param hypothesis with a layer where the contact model has a table over one; its weight is
  /// ignored. It outlives this object
  /// @param contact with its prior; a table has one set of numbers
  /// @throws Error on a lattice, contact model or map that is not sound
  PressPlacer(const Hypothesis& hypothesis, const ContactModel& contact,
              const PoseLattice& lattice);

  /// @throws Error on a press that lies so far from the pivot that its samples are more than
  /// `most_cells`
  PressPlacement place(std::span<const TouchEvidence> press);
  /// The log-likelihood at every bin, in nats, by the nearest samples.
  /// @throws Error as place() does
  std::vector<float> log_likelihoods(std::span<const TouchEvidence> press);
  /// The log-likelihood at any pose, in nats, at the elements' own places.
  double log_likelihood(std::span<const TouchEvidence> press, const Pose& T_object_robot) const {
    return likelihood_.at(press, T_object_robot);
  }

 private:
  /// One axis of the samples: `per_step` of them to a step of the lattice.
  struct Samples {
    double first_mm = 0.0;
    double step_mm = 1.0;
    int per_step = 1;
    int columns = 0;  ///< steps that the samples cover

    int nearest(double mm) const;
  };
  /// An element relative to the pivot, and what it reads.
  struct Element {
    glm::dvec2 from_pivot_mm;
    Reading reading;
  };

  std::vector<Element> elements_of(std::span<const TouchEvidence> press) const;
  void cover(double reach_mm);
  /// Where an element's samples begin for one theta, in a table.
  /// @param turned the element relative to the pivot, in mm along the object frame's axes
  std::size_t first_sample(const glm::dvec2& turned) const;
  /// Adds to every bin the elements' samples, each of the table that its reading has, if any.
  template <typename TableOf>
  void add(const std::vector<Element>& elements, const TableOf& table_of,
           std::vector<float>& bins) const;

  const OccupancyGrid& layer_;
  ContactModel contact_;  ///< with a table
  MapLikelihood likelihood_;
  PoseLattice lattice_;
  double reach_mm_ = -1.0;  ///< the tables cover elements so far from the pivot
  Samples x_;
  Samples y_;
  /// [y phase, x phase, row, column] in nats, and some more to read past the end: the
  /// log-likelihood of No Contact, by how much that of each level of contact exceeds it, and that
  /// of Unknown.
  std::vector<float> no_contact_;
  std::vector<std::vector<float>> contact_excess_;
  std::vector<float> unknown_excess_;
  std::vector<Element> resting_;  ///< elements of rest_
  std::vector<float> rest_;       ///< log-likelihood of No Contact everywhere, [theta, y, x]
};

/// A lattice for placing presses on maps: T_object_robot within a square about the middle of the
/// box around all maps, as wide as the box's shorter side, at steps of at most `step_mm`; all
/// angles at steps of at most `step_rad`. A press that is farther off shows little of the map.
PoseLattice placing_lattice(std::span<const TrainingMap> maps, double step_mm, double step_rad);

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
