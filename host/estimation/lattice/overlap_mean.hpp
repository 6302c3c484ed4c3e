#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "estimation/lattice/dense_belief.hpp"
#include "gpu/command_stream.hpp"
#include "model/bounding_box.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "palpate/touch.hpp"
#include "shaders/interface.h"

namespace palpate {

/// A touch's likelihood summed over some bins of an object.
struct OverlapSum {
  double log_sum = 0.0;  ///< in nats; -infinity where there is no such bin
  std::int64_t bins = 0;
};

/// Sums a touch's likelihood, object by object, over the bins at which the array overlaps the
/// object: at which the rectangle around its elements, parallel to the sensor's axes, meets the box
/// around the map's cells with log odds above 0.
class OverlapMean {
 public:
  OverlapMean(gpu::Context& context, gpu::CommandStream& stream, const DenseBelief& belief,
              std::span<const Hypothesis> hypotheses, const PoseLattice& lattice);

  static std::uint64_t bytes_needed(const PoseLattice& lattice, std::size_t objects);
  std::uint64_t device_bytes() const;

  /// Runs the stream.
  /// @param scratch with a touch's log-likelihood in the low words, as
  /// DisplacementBlur::sum_turns() leaves it
  /// @param everywhere whether all bins count, wherever the array is
  /// @returns [object], until the next call
  std::span<const OverlapSum> sums(const DenseBelief& scratch, const Touch& touch,
                                   const glm::dvec2& pivot_mm, bool everywhere);

 private:
  gpu::CommandStream& stream_;
  PoseLattice lattice_;
  std::size_t objects_;
  gpu::Kernel kernel_;
  gpu::Buffer arrays_;
  gpu::Buffer boxes_;
  gpu::Buffer partials_;
  // Memory that calls share.
  std::vector<shaders::ArrayAtTheta> placed_;
  std::vector<shaders::OverlapPartial> read_partials_;
  std::vector<double> largest_;
  std::vector<double> sum_;
  std::vector<OverlapSum> sums_;
};

}  // namespace palpate
