#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "command_stream.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// A part of an object's bins that fits one storage binding and one dispatch: `theta_count` planes
/// from `theta_first`, and of each the (x, y) indices [plane_first, plane_first + plane_count).
struct Slab {
  std::uint32_t theta_first = 0;
  std::uint32_t theta_count = 0;
  std::uint32_t plane_first = 0;
  std::uint32_t plane_count = 0;
  gpu::Buffer log_likelihood;  ///< [theta, plane], two floats each

  std::int64_t bins() const { return std::int64_t{theta_count} * plane_count; }
};

/// A log-likelihood as two floats, as the kernels keep it.
struct TwoFloat {
  float high = 0.0F;
  float low = 0.0F;
  double value() const { return static_cast<double>(high) + low; }
};

/// What a reduction over one object's bins finds.
struct BeliefSummary {
  TwoFloat max;
  std::int64_t arg_max = 0;  ///< the lowest bin that has it
  double sum = 0.0;          ///< of exp(log-likelihood - max) over the bins, at least 1
};

/// The summed log-likelihood of every pose bin of every object, on the device, and the reductions
/// over it. Zero bits at the start: a uniform belief.
class Belief {
 public:
  Belief(gpu::Context& context, gpu::CommandStream& stream, const PoseLattice& lattice,
         std::size_t objects);

  /// Records the return to a uniform belief.
  void clear();
  std::span<const Slab> slabs(std::size_t object) const { return slabs_[object]; }
  std::uint64_t device_bytes() const;

  // These run the stream.
  std::vector<BeliefSummary> summarise() const;
  /// Sums of exp(log-likelihood - max) over theta, [ny, nx].
  std::vector<float> sum_over_theta(std::size_t object, TwoFloat max) const;
  /// Sums of exp(log-likelihood - max) over (x, y), [ntheta].
  std::vector<float> sum_over_plane(std::size_t object, TwoFloat max) const;
  /// All bins of one object, [theta, y, x].
  std::vector<double> download(std::size_t object) const;

 private:
  gpu::Context& context_;
  gpu::CommandStream& stream_;
  PoseLattice lattice_;
  std::vector<std::vector<Slab>> slabs_;
  gpu::Kernel reduce_;
  gpu::Kernel sum_over_theta_;
  gpu::Kernel sum_over_plane_;
  gpu::Buffer partials_;  ///< of all slabs in order
  std::size_t partial_count_ = 0;
};

}  // namespace palpate
