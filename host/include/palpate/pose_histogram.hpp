#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "palpate/api.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/device.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "palpate/pose.hpp"

namespace palpate {

struct HistogramOptions {
  PoseLattice lattice = {};
  ContactModel contact = {};  ///< what the sensor says about a place (Eq. 3, 7)
  /// Prior weight W of "none of these", an object that was never learned, relative to the
  /// hypotheses' weights. Positive; by default "none of these" is left out.
  ///
  /// Each touch of such an object is explained by a piece of some known object, and the pieces
  /// share no pose: evidence = W s (product over the touches of the touch's mean likelihood). The
  /// mean is over the hypotheses by weight and over the bins at which the touch's array overlaps
  /// the box around the object's cells with log odds above 0; over all bins where there is no such
  /// bin. s is the share of the bins over which the first touch's mean is. So the odds after one
  /// touch are about those of the weights. "None of these" takes memory for one more belief.
  std::optional<double> none_weight = {};
  /// How far the sensor may really have been from T_robot_sensor, in its own frame, at each touch
  /// by itself. A touch's likelihood is its mean over these displacements. By default poses are
  /// exact.
  DisplacementSd touch_sd = {};
  /// How far the object may move between two touches, about the centroid of its map's cells with
  /// log odds above 0, which leaves the identity as it is. By default the object rests.
  DisplacementSd slip_sd = {};
};

/// Histogram filter over object identity and planar pose (Sec. III-C, Eq. 13-16): the log-belief of
/// a regular lattice of poses for every object, on the device. Two floats hold each bin, so that
/// rounding does not grow with the number of touches. The same input gives the same bits on one
/// device. A histogram that was moved from throws Error on every call.
class PALPATE_API PoseHistogram {
 public:
  /// Uploads the maps and starts with a uniform belief.
  /// @throws Error on an empty list, a map that is not sound (see fault_of()), maps of different
  /// priors where the options give none, a weight that is not positive and finite, a lattice or a
  /// contact model out of range, a table for another number of objects, or where the device has too
  /// little memory: where the bins alone are more, before any is taken
  PoseHistogram(Device& device, std::span<const Hypothesis> hypotheses,
                const HistogramOptions& options);

  /// Returns to the uniform belief, for the next unknown. @throws Error if the device fails
  void reset();

  /// Turns theta about another pivot, in the robot frame. The belief must be the uniform one, so
  /// that the same bins serve the new poses and no memory changes. The pivot stays over reset().
  /// @throws Error after an update() or on a pivot out of range, and changes nothing
  void move_pivot(const glm::dvec2& pivot_mm);

  /// Multiplies the belief by the likelihood of these touches (Eq. 7, 13). Calls `progress` with
  /// the fraction done from time to time. Takes in no touch at all if one of them is not sound. If
  /// the device fails, memory ends or `progress` throws, the belief may be left half-way: every
  /// call but reset() then throws Error until reset() is called. Allocates seldom: see
  /// docs/embedding.md.
  /// @throws Error on a touch that is not sound, or if the device fails; what `progress` throws
  void update(std::span<const Touch> touches, const std::function<void(double)>& progress = {});
  void update(const Touch& touch) { update(std::span(&touch, 1)); }
  /// Touches that are classified by the options' contact model already.
  PALPATE_LOCAL void update(std::span<const TouchEvidence> touches,
                            const std::function<void(double)>& progress);

  /// Identity probabilities (Eq. 14) and mode (Eq. 15-16). Of equal bins the mode is the lowest bin
  /// of the first object.
  /// @throws Error if the device fails
  Estimate estimate() const;

  /// The refined pose near a mode, and its covariance: where the posterior peaks, which is seldom
  /// the centre of a bin. Reads of the mode only `object` and `bin`, or `T_object_robot` where the
  /// mode has no bin.
  ///
  /// Fits a quadratic to the log-belief around its mean under weights belief^(1/n), n >= 8, and
  /// returns the quadratic's peak. The window holds the poses that move the object by at most 2.5
  /// mm (root mean square over its occupied cells), and at least the neighbouring bins; it is
  /// re-centred on the mean up to twice. Returns the weighted mean instead where the window holds
  /// fewer than two bins per coefficient or the quadratic has no peak within 1 mm and the region.
  /// The covariance is the inverse of minus the quadratic's second derivatives. Where the belief in
  /// the window spreads by more than 0.8 mm, or there is no quadratic, it is the belief's second
  /// moment about the returned pose, plus the variance of a uniform distribution over one bin.
  ///
  /// Modes outside the window do not show in the result. The window continues at theta's first bin
  /// after its last where theta covers the full circle, and ends at the region's edges. An axis of
  /// zero extent keeps its value. The covariance is too small where touches lie elsewhere than
  /// reported, and knows nothing of errors of the map. docs/refinement.md says how large the errors
  /// are.
  /// @throws Error if there is no such object or bin, the pose is not finite, or the device fails
  RefinedPose refine(const Mode& mode) const;

  /// Marginal probabilities of one object's poses, on lattice(). The marginals of all objects and
  /// `none` together sum to 1.
  /// @throws Error if there is no such object, or the device fails
  Marginals marginals(int object) const;
  /// The bins that hold at least `least_share` of their object's belief, [object], each with its
  /// share, for every one of the given objects; at most 1 / least_share bins of each.
  /// @throws Error if there is no such object, or the device fails
  std::vector<std::vector<BinShare>> likely_bins(std::span<const int> objects,
                                                 double least_share) const;
  /// Log-likelihood of every bin of one object in nats, [theta, y, x], without prior weights.
  /// @throws Error if there is no such object, or the device fails
  std::vector<double> log_likelihood(int object) const;

  /// Entropy of the belief over objects and bins in nats, -sum p log p, "none of these" left out:
  /// log(objects * bins) where nothing is known, near 0 where one bin has all the probability.
  /// Within 1e-3 nats. Costs the transfer of the bins that hold the belief, all of them where it is
  /// uniform.
  /// @throws Error if the device fails
  double entropy() const;

  /// Draws objects and poses from the belief, "none of these" left out. A pose lies anywhere in its
  /// bin with equal probability. Draws come in the order of objects and bins; the same seed gives
  /// the same draws on one device.
  /// @throws Error if the device fails
  std::vector<PoseSample> sample(std::size_t count, std::uint64_t seed) const;

  /// What one more touch at each candidate pose T_robot_sensor is expected to tell, for choosing
  /// the next best touch (greedy). Each of `samples` draws of the belief simulates a touch's
  /// readings by the maps and the contact model, elements independent given the pose; the gain is
  /// the mutual information between these readings and the draws. Where the object slips, the draws
  /// slip first, if it has been touched; where touches are uncertain, readings come from a
  /// displaced sensor and likelihoods are means over displacements. Leaves "none of these" out. The
  /// same seed gives the same gains on one device, and all candidates the same random numbers.
  /// @param elements_mm [e] living elements of the array, in the sensor frame
  /// @returns a gain for each candidate, in their order
  /// @throws Error on no candidate or element, one that is not finite, samples out of [2, 4096],
  /// labels for another number of objects, or if the device fails
  std::vector<TouchGain> expected_gain(std::span<const Pose> T_robot_sensor,
                                       std::span<const glm::dvec2> elements_mm,
                                       const PlanOptions& options = {}) const;

  const PoseLattice& lattice() const;
  /// How the likelihood is evaluated for each cell size among the maps, and why.
  std::vector<std::string> paths() const;
  /// Device memory held, in bytes, maps and tables included.
  std::uint64_t device_bytes() const;

 private:
  struct PALPATE_LOCAL Impl;
  PALPATE_LOCAL Impl& impl() const;
  /// impl(), where no update has left the belief half-way. @throws Error where one has
  PALPATE_LOCAL Impl& unbroken() const;
  std::unique_ptr<Impl, void (*)(Impl*)> impl_{nullptr, nullptr};
};

}  // namespace palpate
