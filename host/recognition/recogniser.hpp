#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "model/touch_evidence.hpp"
#include "recognition/filter.hpp"
#include "recognition/recognition_task.hpp"

namespace palpate {

/// How much touches of one unknown tell beside each other. Readings of one place share what the map
/// lacks there, and do not multiply as those of different places do. So each touch has a weight,
///   w_i = max(0, 1 - sum over earlier j of w_j k(d_ij) min(1, 2 c_j / c_i)),
///   k(d) = max(0, 1 - (d / s)^2),
/// with d the elements' root mean square distance between the two touches, s the elements' spacing
/// and c the number of elements In Contact: a press after a mere brush tells its own. About any
/// place the weights sum to about one, and touches further apart than s keep theirs. The first
/// touch of a place counts whole, whatever comes later, so that beliefs need no second look at it.
class TouchPlaces {
 public:
  void clear() { *this = {}; }
  /// The touch with as many of its known elements as its weight says, spread over the array; the
  /// others are Unknown. So all filters, "(none)" and the fit give it that weight. It belongs to
  /// the touches before from now on.
  TouchEvidence add(const TouchEvidence& touch);
  /// What to say where touches are written twice, or lie so close together that they count as half
  /// as many at most; else "".
  std::string words() const;

 private:
  struct Place {
    glm::dvec2 middle_mm{0.0};  ///< mean of the elements in the robot frame
    double theta_rad = 0.0;
    double square_mm2 = 0.0;  ///< elements' mean squared distance from the middle
    double contacts = 0.0;
    double force = 0.0;  ///< TouchEvidence::force
    double weight = 1.0;
  };

  static Place place_of(const TouchEvidence& touch);
  double weight_of(const Place& place, const TouchEvidence& touch) const;
  TouchEvidence thinned(const TouchEvidence& touch, double weight) const;

  std::vector<Place> places_;  ///< of touches with a weight above 0
  std::size_t touches_ = 0;    ///< In Contact
  std::size_t repeated_ = 0;   ///< of these, equal to an earlier one to the digit
  double counted_ = 0.0;       ///< sum of their weights
};

/// The filter that a task names. Functions throw Error as those of PoseHistogram, BoundedPosterior
/// and ParticleFilter do.
class Recogniser {
 public:
  Recogniser(Device& device, const RecognitionTask& task) : Recogniser(&device, task, {}) {}
  /// By bounds, which need no device.
  explicit Recogniser(const RecognitionTask& task, const FilterResources& search = {})
      : Recogniser(nullptr, task, search) {}

  /// Forgets all touches, for the next unknown. Particles start from the same places again; bounds
  /// keep their tables. An automatic pivot returns to the robot frame's origin until a touch places
  /// it.
  void reset();
  /// Updates the belief with these touches. The first touch since reset() that has an element In
  /// Contact (Eq. 3) places an automatic pivot. The touches before it wait, and join the
  /// belief together with that touch; until then the belief is the one before any touch.
  /// `progress` is called now and then with the fraction done.
  void update(std::span<const Touch> touches, const std::function<void(double)>& progress = {});
  /// What the belief tells.
  const Filter& filter() const { return *filter_; }
  /// See Filter::estimate().
  Estimate estimate(std::optional<double> tolerance = {}) const {
    return filter_->estimate(tolerance);
  }
  /// Whether the belief has taken in a touch since reset(). Touches that wait for an automatic
  /// pivot do not count.
  bool touched() const { return touched_; }
  /// All touches since reset(), in order, those that wait for an automatic pivot included; weighed
  /// by place where RecognitionTask::by_place says so.
  std::span<const TouchEvidence> evidence() const { return evidence_; }
  /// See Filter::marginals().
  Marginals marginals(int object) const { return filter_->marginals(object, lattice_); }
  /// See Filter::likely_bins().
  /// @param lattice receives the lattice that the bins are of
  std::vector<std::vector<BinShare>> likely_bins(std::span<const int> objects, double least_share,
                                                 PoseLattice& lattice) const {
    lattice = lattice_;
    return filter_->likely_bins(objects, least_share, lattice);
  }
  /// The task's lattice about the pivot in use.
  const PoseLattice& lattice() const { return lattice_; }
  /// What to say where the lattice does not resolve the filter's touch_sd or slip_sd at one of the
  /// touches since reset(); else "".
  std::string unresolved_words() const;
  /// See TouchPlaces::words().
  std::string place_words() const { return places_.words(); }

 private:
  /// Whether an automatic pivot has yet to be placed.
  bool lacks_pivot() const { return auto_pivot_ && !pivot_placed_; }
  /// Moves the pivot to the array's centre.
  void place_pivot(const TouchEvidence& touch);
  void move_pivot(const glm::dvec2& pivot_mm);

  Recogniser(Device* device, const RecognitionTask& task, const FilterResources& search);

  FilterTraits traits_;
  PoseLattice lattice_;
  ContactModel contact_;
  bool auto_pivot_;
  bool by_place_;
  TouchPlaces places_;                   ///< since reset(); only where touches count by place
  bool pivot_placed_ = false;            ///< by a touch since reset(); only where it is automatic
  std::vector<TouchEvidence> evidence_;  ///< in order; waits where the pivot lacks
  bool touched_ = false;                 ///< since reset()
  std::unique_ptr<Filter> filter_;
};

}  // namespace palpate
