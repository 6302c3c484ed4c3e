#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "palpate/contact.hpp"
#include "palpate/device.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

struct HistogramOptions {
  PoseLattice lattice;
  ContactClassifier classifier;
  double gamma = 0.1;
  /// p(m) of Eq. 7 and of the space beyond the maps; by default the maps' own, which must then be
  /// the same for all: unequal priors would favour the emptier or the fuller map in unseen space.
  std::optional<double> prior = {};
  /// The array stays where it is from touch to touch, as a large one under a table of objects does:
  /// a touch of No Contact everywhere is then evaluated once, and of every touch only the elements
  /// that say something else. The result is the same but for rounding; it takes twice the memory.
  bool still_array = false;
  /// Prior weight of "none of these", relative to the hypotheses': an object that was never
  /// learned, whose map holds only the prior. It costs no bins: its likelihood is the same at every
  /// pose. A positive number, or none.
  std::optional<double> none_weight = {};
  /// Most memory of the device that the histogram may take, in bytes, staging memory included; by
  /// default all of it. Tables shrink to fit, which costs time and changes no bit of the result.
  std::optional<std::uint64_t> memory_limit_bytes = {};
};

/// Histogram filter over object identity and planar pose (Sec. III-C, Eq. 13-16): a dense lattice
/// of poses for every object, kept in logs on the device, in two floats per bin so that accuracy
/// does not decay with the number of touches. The same input gives the same bits on one device. A
/// histogram that was moved from throws Error whatever it is asked.
class PoseHistogram {
 public:
  /// Uploads the maps and sets a uniform belief. Ties go to the first object and the lowest bin.
  /// @throws Error on an empty list, a map that is not sound (see fault_of()), maps of
  /// different priors where none is given, weights that are not positive and finite, a lattice,
  /// classifier, gamma or prior out of range, or more memory than the limit or the device allows,
  /// which is said before any is taken.
  PoseHistogram(Device& device, std::span<const Hypothesis> hypotheses,
                const HistogramOptions& options);
  ~PoseHistogram();
  PoseHistogram(PoseHistogram&&) noexcept;
  PoseHistogram& operator=(PoseHistogram&&) noexcept;

  /// Back to the uniform belief, for the next unknown.
  void reset();

  /// Multiplies the belief by the likelihood of these touches (Eq. 7, 13). `progress` is called
  /// with the fraction done, now and then. A touch that is not sound refuses all of them, and the
  /// belief stays as it was. Where the device fails or `progress` throws, the belief is half-way
  /// between before and after: all but reset() then throw Error until reset() is called.
  /// @throws Error on a touch that is not sound, or if the device fails; what `progress` throws
  void update(std::span<const Touch> touches, const std::function<void(double)>& progress = {});
  void update(const Touch& touch) { update(std::span(&touch, 1)); }

  /// Evaluates a touch that is likely to come next, so that update() with that touch alone, of the
  /// same readings at the same place, only has to add it: for a touch that is known before it ends.
  /// The result is the same but for rounding, and the belief does not change before. Takes memory
  /// for a second belief from the first call on; where the device or the limit has none, nothing is
  /// done. Nor is it for a still array.
  /// @throws Error on a touch that is not sound, or if the device fails
  void prepare(const Touch& touch);

  /// Identity probabilities (Eq. 14) and mode (Eq. 15-16).
  /// @throws Error if the device fails
  Estimate estimate() const;

  /// The pose between the bins near a mode, and its covariance. Reads of the mode only `object` and
  /// `bin`, or `T_object_robot` where the mode has no bin.
  ///
  /// Fits a quadratic to the log-belief around its mean under weights belief^(1/n), n >= 8, and
  /// returns the quadratic's peak. The window holds the poses that move the object by at most 2.5
  /// mm (root mean square over its occupied cells), and at least the neighbouring bins; it is
  /// re-centred on the mean up to twice. Returns the weighted mean instead where the window holds
  /// fewer than two bins per coefficient or the quadratic has no peak within 1 mm and the region.
  /// The covariance is the second moment of the belief in the window about the returned pose, plus
  /// the variance of a uniform distribution over one bin.
  ///
  /// Modes outside the window do not show in the result. The window continues at theta's first bin
  /// after its last where theta covers the full circle, and ends at the region's edges. An axis of
  /// zero extent keeps its value. The covariance is too small on bins much wider than the belief
  /// and where touches lie elsewhere than reported. docs/refinement.md says how large the errors
  /// are.
  /// @throws Error if there is no such object or bin, the pose is not finite, or the device fails
  RefinedPose refine(const Mode& mode) const;

  /// Marginal probabilities of one object's poses, on lattice(). The marginals of all objects and
  /// `none` together sum to 1.
  /// @throws Error if there is no such object, or the device fails
  Marginals marginals(int object) const;
  /// Log-likelihood of every bin of one object in nats, [theta, y, x], without prior weights.
  /// @throws Error if there is no such object, or the device fails
  std::vector<double> log_likelihood(int object) const;

  const PoseLattice& lattice() const;
  /// How the likelihood is evaluated for each cell size among the maps, and why so.
  std::vector<std::string> paths() const;
  /// Device memory held, in bytes, maps and tables included.
  std::uint64_t device_bytes() const;

 private:
  struct Impl;
  Impl& impl() const;
  /// The same, with a belief that no update has left half-way.
  Impl& whole() const;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
