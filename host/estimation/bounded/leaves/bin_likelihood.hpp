#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "estimation/bin_box.hpp"
#include "estimation/bounded/displaced/displacement_mean.hpp"
#include "estimation/bounded/leaves/bin_kernel.hpp"
#include "estimation/known_elements.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// A map, how a lattice's bins lie on it, and what bounds the rounding of log odds there.
struct PlacedMap {
  /// @throws Error where the map has too many cells
  PlacedMap(const OccupancyGrid& map, double prior, const PoseLattice& lattice);

  /// Bound, in cells along an axis, of the float64 rounding of an element's place at a bin.
  double place_error(const KnownElements& elements) const;

  MapPatches nodes;
  double cell_mm;
  glm::dvec2 origin_mm;
  double lattice_cells;  ///< no bin nor node is farther from the frames' origins
  double reach_cells;    ///< no bin's position is larger; from farther elements all bins are off
  PositionGrid grid;

  // Over all nodes of the map and the prior beyond.
  double largest = 0.0;   ///< magnitude
  double range = 0.0;     ///< largest less smallest
  double steepest = 0.0;  ///< difference between neighbours along an axis
};

/// Evaluates the log-likelihood (Eq. 7, 13) of bins on the host, by vector instructions chosen at
/// run time. A bin has the same bits with every set of instructions, on every number of threads and
/// in every box. Calls from several threads may run at once, but for those about the same touches
/// with KnownElements::undisplaced_bins. Displaced touches have their mean likelihoods: all bins
/// within reach of a bin are evaluated, too, and boxes that lie together share them.
class BinLikelihood {
 public:
  /// @param contact resolved: with its prior
  /// @param touch_sd how far touches may be displaced
  /// @throws Error where a map has too many cells
  BinLikelihood(std::span<const Hypothesis> hypotheses, const ContactModel& contact,
                const PoseLattice& lattice, const DisplacementSd& touch_sd = {});
  void move_pivot(const glm::dvec2& pivot_mm) { lattice_.pivot_mm = pivot_mm; }

  /// Log-likelihood of the elements at every bin in nats, boxes one after another, [y, x] in each.
  /// On the threads of the caller's TBB arena. Fastest where boxes of one object and theta stand
  /// together.
  void evaluate(std::span<const BinBox> boxes, const KnownElements& elements,
                std::span<double> log_likelihood) const;
  /// Proven bound, in nats, of the error of evaluate() at any bin of an object.
  double error(std::size_t object, const KnownElements& elements) const;
  /// evaluate() and its error() as if no touch were displaced.
  void evaluate_undisplaced(std::span<const BinBox> boxes, const KnownElements& elements,
                            std::span<double> log_likelihood) const;
  double undisplaced_error(std::size_t object, const KnownElements& elements) const;

  /// Host memory that the maps' nodes and the table hold.
  std::uint64_t bytes() const;

 private:
  /// evaluate_undisplaced() on the caller's thread.
  void evaluate_on_this_thread(std::span<const BinBox> boxes, const KnownElements& elements,
                               double* log_likelihood) const;
  /// Sets a touch's bins as if it were undisplaced, on the caller's thread.
  void evaluate_blocks(std::size_t object, std::span<const BlockRun> runs,
                       const KnownElements& touch, const PlaceRows<double>& rows) const;
  void evaluate_displaced(std::span<const BinBox> boxes, const KnownElements& elements,
                          std::span<double> log_likelihood) const;

  std::vector<PlacedMap> maps_;  ///< [object]
  ReadingForm form_;
  PoseLattice lattice_;
  std::optional<DisplacementMean> displaced_;  ///< of bins; nothing where touches are undisplaced
};

}  // namespace palpate
