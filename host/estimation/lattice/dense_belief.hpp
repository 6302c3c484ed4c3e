#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bin_window.hpp"
#include "command_stream.hpp"
#include "kernel_sizes.hpp"
#include "palpate/lattice.hpp"
#include "slab.hpp"
#include "two_float.hpp"

namespace palpate {

/// What a reduction over one object's bins finds.
struct BeliefSummary {
  TwoFloat max;
  std::int64_t arg_max = 0;  ///< the lowest bin that has it
  double sum = 0.0;          ///< of exp(log-likelihood - max) over the bins, at least 1
};

/// Sums of exp(log-likelihood - max) over parts of one object's bins.
struct BeliefMarginals {
  std::vector<double> xy;     ///< over theta, [ny, nx]
  std::vector<double> theta;  ///< over (x, y), [ntheta]
};

/// The summed log-likelihood of every pose bin of every object, on the device, and the reductions
/// over it. Zero bits at the start: a uniform belief.
class DenseBelief {
 public:
  DenseBelief(gpu::Context& context, gpu::CommandStream& stream, const PoseLattice& lattice,
              std::size_t objects);
  /// A uniform belief over the same lattice and objects.
  DenseBelief uniform() const { return {context_, stream_, lattice_, objects_}; }

  /// How a belief is cut.
  static std::vector<SlabExtent> cut(const gpu::Context& context, const PoseLattice& lattice,
                                     std::size_t objects);
  /// Device memory that a belief takes, in bytes, and what marginals() takes while it runs.
  static std::uint64_t bytes_needed(const gpu::Context& context, const PoseLattice& lattice,
                                    std::size_t objects);
  static std::uint64_t marginal_bytes(const gpu::Context& context, const PoseLattice& lattice,
                                      std::size_t objects);

  /// Records the return to a uniform belief.
  void clear();
  /// Records the addition of another belief over the same lattice and objects.
  void add(const DenseBelief& other);
  std::span<const Slab> slabs() const { return slabs_; }
  std::uint64_t device_bytes() const;

  // These run the stream.
  std::vector<BeliefSummary> summarise() const;
  BeliefMarginals marginals(std::size_t object, TwoFloat max) const;
  /// All bins of one object, [theta, y, x].
  std::vector<double> download(std::size_t object) const;
  /// The bins of a window, [theta, y, x].
  std::vector<double> download(std::size_t object, const BinWindow& window) const;

 private:
  gpu::Context& context_;
  gpu::CommandStream& stream_;
  PoseLattice lattice_;
  std::size_t objects_;
  std::vector<Slab> slabs_;
  ReductionSizes reduction_;
  MarginalSizes marginal_;
  gpu::Kernel reduce_;
  gpu::Kernel sum_marginals_;
  gpu::Kernel add_;
  gpu::Buffer partials_;  ///< of all slabs in order
  std::size_t partial_count_ = 0;
};

}  // namespace palpate
