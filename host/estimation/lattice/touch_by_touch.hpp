#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "estimation/lattice/dense_belief.hpp"
#include "estimation/lattice/dense_likelihood.hpp"
#include "estimation/lattice/displacement_blur.hpp"
#include "estimation/touch_overlap.hpp"
#include "gpu/command_stream.hpp"
#include "model/touch_evidence.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "palpate/pose_histogram.hpp"
#include "shaders/interface.h"

namespace palpate {

/// A touch's likelihood summed over some bins of all objects, by the objects' prior probabilities.
struct OverlapSum {
  double log_sum = 0.0;  ///< in nats; no number where there is no such bin
  double bins = 0.0;     ///< so many, on average
};

/// Sums a touch's likelihood, as if it lay where the robot says, over the bins at which the array
/// overlaps the object: at which the rectangle around its elements, parallel to the sensor's axes,
/// meets the box around the map's cells with log odds above 0.
class OverlapMean {
 public:
  OverlapMean(gpu::Context& context, gpu::CommandStream& stream, const DenseBelief& belief,
              std::span<const Hypothesis> hypotheses, const std::vector<double>& log_weight,
              const PoseLattice& lattice);

  std::uint64_t device_bytes() const;

  /// Runs the stream.
  /// @param scratch with a touch's log-likelihood in the high words
  /// @param everywhere whether all bins count, wherever the array is
  OverlapSum sum(const DenseBelief& scratch, const ArrayRectangle& array, bool everywhere);

 private:
  struct ObjectSum {
    double largest = -std::numeric_limits<double>::infinity();
    double sum = 0.0;      ///< relative to the largest
    double log_sum = 0.0;  ///< with the prior probability
    std::int64_t bins = 0;
  };

  gpu::CommandStream& stream_;
  const std::vector<double>& log_weight_;  ///< [object]
  PoseLattice lattice_;
  gpu::Kernel kernel_;
  gpu::Buffer arrays_;
  gpu::Buffer boxes_;
  std::vector<shaders::OverlapPartial> read_partials_;  ///< of each plane of each slab
  gpu::Buffer partials_;
  // Memory that calls share.
  std::vector<shaders::ArrayAtTheta> placed_;
  std::vector<ObjectSum> of_objects_;
};

/// The update of a belief where each touch's likelihood is wanted by itself before it joins the
/// belief: displaced touches, objects that slip between touches, or "none of these". Takes one more
/// dense belief.
class TouchByTouch {
 public:
  /// Whether the options ask for it.
  static bool wanted_by(const HistogramOptions& options);

  /// Leaves the belief uniform.
  /// @param options outlive this object; the lattice's pivot may move
  /// @throws Error where the device cannot blur such a lattice
  TouchByTouch(gpu::Context& context, gpu::CommandStream& stream, const HistogramOptions& options,
               std::span<const Hypothesis> hypotheses, const std::vector<double>& log_weight,
               DenseBelief& belief);

  /// Adds a touch. `evaluate` adds its log-likelihood at every bin to a belief that is uniform.
  void update(const TouchEvidence& touch, const std::function<void(const DenseBelief&)>& evaluate,
              DenseBelief& belief);
  /// Forgets all touches.
  void reset();

  /// What a slip has taken from the summed likelihood of each object, in nats, [object]: to be
  /// added to the log-likelihood of every bin.
  const std::vector<double>& lost_mass() const { return lost_mass_; }
  /// Log evidence of "none of these" without its weight: the share of the bins at which the first
  /// touch's array overlaps an object, times the mean likelihoods of all touches over such bins.
  double none_log_evidence() const { return none_log_evidence_; }

  std::uint64_t device_bytes() const;

 private:
  void slip(DenseBelief& belief);
  void add_to_none(const ArrayRectangle& array);

  gpu::CommandStream& stream_;
  const HistogramOptions& options_;
  std::size_t objects_;
  DenseBelief scratch_;
  DisplacementBlur touch_blur_;
  std::optional<DisplacementBlur> slip_blur_;
  std::optional<OverlapMean> overlap_;
  std::vector<double> lost_mass_;
  // Memory that updates share.
  std::vector<TwoFloat> references_;  ///< all 0
  std::vector<TwoFloat> largest_;
  std::vector<BeliefSummary> before_slip_;
  std::vector<BeliefSummary> after_slip_;
  double none_log_evidence_ = 0.0;
  bool touched_ = false;
  bool felt_ = false;  ///< by a touch with a known element
};

}  // namespace palpate
