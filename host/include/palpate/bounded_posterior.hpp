#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "palpate/api.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "palpate/pose.hpp"

namespace palpate {

struct BoundedOptions {
  PoseLattice lattice = {};
  ContactModel contact = {};  ///< what the sensor says about a place (Eq. 3, 7)
  /// How far every touch's sensor may have been from where the robot says, as
  /// HistogramOptions::touch_sd: each touch's likelihood is its mean over these places.
  DisplacementSd touch_sd = {};
  /// Largest total variation distance from the posterior over all bins, in (0, 1). Each estimate()
  /// evaluates as many bins as the tolerance needs. The certificate counts the rounding of float64,
  /// which alone may exceed a tolerance below about 1e-8, or any where there are many hundred
  /// touches or the region lies more than 10 m away.
  double tolerance = 1e-6;
  /// Seconds after which estimate() stops and reports what it has proven by then, also where that
  /// is less than the tolerance asks for. By default it takes the time that the tolerance needs.
  std::optional<double> budget_s = {};
  /// Also bounds each label's log evidence (of all hypotheses that bear it) within this many nats,
  /// however unlikely the label is: for a temperature that is applied later. By default only the
  /// tolerance counts.
  std::optional<double> evidence_nats = {};
  /// With evidence_nats: labels whose log evidence lies more nats than this below the largest are
  /// only known to lie there.
  double evidence_range_nats = std::numeric_limits<double>::infinity();
  /// Both grow by this part of themselves with every touch after the first that has a known
  /// element, as a temperature does that suits several touches. From 0.
  double evidence_growth = 0.0;
  /// Bins to evaluate before a search ends with what it has proven, where no bin of these explains
  /// the touches: where the best costs more than three quarters of the nats that the touches cost
  /// off the map. By default such a search goes on, too. Where nothing fits, many bins fit
  /// about as badly.
  std::optional<std::int64_t> poor_bins = {};
  /// Prior weight W of "none of these", as HistogramOptions::none_weight. Each touch's mean
  /// likelihood is bounded by searches of its own, until the log odds of "none of these" against
  /// the objects are known within 0.3 nats, or it or the objects are known to have less than the
  /// tolerance or 1e-4, whichever is larger. With evidence_nats, it is known as closely as the
  /// labels are; where evidence_range_nats is infinite, never less closely than without.
  /// Certificate::none_log_evidence holds its bounds; Certificate::dropped_mass is of the objects'
  /// bins alone.
  std::optional<double> none_weight = {};
  /// Host threads; 0 takes as many as the machine has cores.
  int threads = 0;
  /// Called between the steps of every search, on a thread of the search, one at a time. What it
  /// throws ends the search, and the call that asked for it throws the same; the belief stays as it
  /// was, and the next call searches anew.
  std::function<void()> cancel_point = {};
};

/// A block of bins of one hypothesis at one theta that a search divided into smaller ones or, at
/// the last level, evaluated.
struct PoseBlock {
  int object = 0;  ///< index into the hypotheses
  int level = 0;   ///< 0 for the largest blocks
  int theta = 0;   ///< index of the lattice's theta
  int x_first = 0;
  int x_count = 0;
  int y_first = 0;
  int y_count = 0;
};

/// What a search evaluated, bin by bin.
struct EvaluatedBelief {
  /// [n] ascending: places of the bins among all of [object, theta, y, x], x fastest.
  std::vector<std::int64_t> index;
  std::vector<double> log_likelihood;  ///< [n] in nats, without prior weights
  /// Bound of the share of the belief that all other bins hold together, by prior weights and
  /// without "none of these". Counts the rounding of the bins here.
  double rest_mass_bound = 0.0;
};

/// Histogram filter over object identity and planar pose that evaluates only the bins that matter
/// and proves how little the others can. Its bins are those of PoseHistogram. Blocks of bins are
/// bounded from above by tables of the smallest penalty within a window of the map; blocks that
/// cannot matter are dropped, and the bins of the others are evaluated. Memory follows the maps and
/// the region, or, where bins lie two cells of a map or more apart, the bins. The result does not
/// depend on the order of touches (but that "none of these" counts the first one's place), on the
/// number of threads or on the processor's vector width, unless a budget ends the search. Objects
/// that slip between touches need PoseHistogram. An object that was moved from throws Error on
/// every call.
class PALPATE_API BoundedPosterior {
 public:
  /// Builds the window tables of the maps.
  /// @throws Error on an empty list, a map that is not sound, maps of different priors where the
  /// options give none, a weight that is not positive and finite, a lattice, contact model or
  /// option out of range, a table for another number of objects, or a lattice whose tiles and
  /// tables would take more than a quarter of the machine's memory
  BoundedPosterior(std::span<const Hypothesis> hypotheses, const BoundedOptions& options);

  /// Returns to the uniform belief, for the next unknown. Keeps the tables.
  void reset();
  /// Turns theta about another pivot, in the robot frame; see PoseHistogram::move_pivot().
  /// @throws Error after an update() or on a pivot out of range, and changes nothing
  void move_pivot(const glm::dvec2& pivot_mm);

  /// Multiplies the belief by the likelihood of these touches (Eq. 7, 13). It only checks and keeps
  /// them: the next call that asks about the belief takes them in. Calls `progress` once, with 1,
  /// before it does so. Takes in no touch at all if one of them is not sound or if `progress`
  /// throws.
  /// @throws Error on a touch that is not sound; what `progress` throws
  void update(std::span<const Touch> touches, const std::function<void(double)>& progress = {});
  void update(const Touch& touch) { update(std::span(&touch, 1)); }
  /// Touches that are classified by the options' contact model already.
  PALPATE_LOCAL void update(std::span<const TouchEvidence> touches,
                            const std::function<void(double)>& progress);

  /// Identity probabilities (Eq. 14) with their bounds, mode (Eq. 15-16) and certificate. Searches
  /// once after each update(), and again where a call has a smaller tolerance than those before it;
  /// other calls return the same.
  /// @param tolerance in place of the options', such as a wider one for a belief that is looked at
  /// on the way to the next touch. Whatever else is asked before the next update(), draws included,
  /// is about the bins that the last search evaluated.
  /// @throws Error on a tolerance that is not between 0 and 1
  Estimate estimate(std::optional<double> tolerance = {}) const;

  /// The refined pose near a mode, and its covariance; see PoseHistogram::refine().
  /// Evaluates the bins of the window that it fits.
  /// @throws Error if there is no such object or bin, or the pose is not finite
  RefinedPose refine(const Mode& mode) const;

  /// Marginal probabilities of one object's poses, on lattice(). The marginals of all objects and
  /// `none` together sum to 1; bins that were dropped count as 0.
  /// @throws Error if there is no such object
  Marginals marginals(int object) const;
  /// Marginal probabilities of one object's poses on another grid; a bin counts in the grid's
  /// nearest bin (PoseLattice::bin_of()).
  Marginals marginals(int object, const PoseLattice& grid) const;
  /// The bins that hold at least `least_share` of their object's belief, [object], each with its
  /// share, for every one of the given objects; at most 1 / least_share bins of each. Shares are
  /// those of the evaluated bins.
  /// @throws Error if there is no such object
  std::vector<std::vector<BinShare>> likely_bins(std::span<const int> objects,
                                                 double least_share) const;
  /// The bins that the search evaluated. Blocks of bins at which every element sees the prior,
  /// beyond the maps, are evaluated at once and belong to the others.
  /// @throws Error where the list would take more than a quarter of the machine's memory
  EvaluatedBelief evaluated_bins() const;
  /// Log-likelihood of any pose of an object in nats, in float64, without prior weights. With
  /// touch_sd, of the bin that the pose lies in.
  /// @throws Error if there is no such object or the pose is not finite
  double log_likelihood(int object, const Pose& T_object_robot) const;

  /// Entropy of the belief over objects and evaluated bins in nats, "none of these" left out.
  double entropy() const;
  /// Draws objects and poses; see PoseHistogram::sample(). Before the first estimate() since an
  /// update, bins that hold up to 1 % of the mass may stay out, more where a
  /// budget ends the search.
  std::vector<PoseSample> sample(std::size_t count, std::uint64_t seed) const;
  /// What one more touch at each candidate pose T_robot_sensor is expected to tell; see
  /// PoseHistogram::expected_gain().
  std::vector<TouchGain> expected_gain(std::span<const Pose> T_robot_sensor,
                                       std::span<const glm::dvec2> elements_mm,
                                       const PlanOptions& plan = {}) const;

  /// The blocks that the search divides or evaluates, for a picture of it. Searches again.
  std::vector<PoseBlock> refined_blocks() const;

  const PoseLattice& lattice() const;
  /// How blocks are bounded and bins evaluated: vector instructions and threads.
  std::string path() const;
  /// Host memory that tables, penalties and evaluated bins hold, in bytes.
  std::uint64_t host_bytes() const;

 private:
  struct PALPATE_LOCAL Impl;
  PALPATE_LOCAL Impl& impl() const;
  /// impl(), where no update has left the belief half-way. @throws Error where one has
  PALPATE_LOCAL Impl& with_touches_taken_in() const;
  std::unique_ptr<Impl, void (*)(Impl*)> impl_{nullptr, nullptr};
};

}  // namespace palpate
