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
  void sum_rest(const std::vector<Element>& elements);
  /// Where an element's samples begin for one theta, in a table.
  /// @param turned the element relative to the pivot, in mm along the object frame's axes
  std::size_t first_sample(const glm::dvec2& turned) const;
  /// Adds up elements' samples at the bins of one theta, to the bins given.
  void add(std::span<const float* const> elements, float* bins) const;

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
  std::vector<glm::dvec2> resting_;  ///< elements of rest_, relative to the pivot
  std::vector<float> rest_;          ///< log-likelihood of No Contact everywhere, [theta, y, x]
};

/// A lattice for placing presses on maps: T_object_robot within a square about the middle of the
/// box around all maps, as wide as the box's shorter side, at steps of at most `step_mm`; all
/// angles at steps of at most `step_rad`. A press that is farther off shows little of the map.
PoseLattice placing_lattice(std::span<const TrainingMap> maps, double step_mm, double step_rad);

}  // namespace palpate
