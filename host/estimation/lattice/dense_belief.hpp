#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "estimation/bin_box.hpp"
#include "estimation/kernel_sizes.hpp"
#include "gpu/command_stream.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// The bins of one object that one workgroup of a reduction covers.
struct BeliefBlock {
  std::size_t slab = 0;
  std::int64_t first = 0;  ///< in the object's part of the slab
  std::int64_t bins = 0;
  double sum = 0.0;  ///< of exp(log-likelihood - the object's max)
};

/// The largest log-likelihood of one object's bins, and their sum (Eq. 14).
struct BeliefSummary {
  TwoFloat max;
  std::int64_t arg_max = 0;              ///< the lowest bin of this log-likelihood
  double sum = 0.0;                      ///< of exp(log-likelihood - max) over the bins, at least 1
  std::vector<BeliefBlock> blocks = {};  ///< in the order of the lattice's bins
};

/// The summed log-likelihood of every pose bin of every object, on the device, and the reductions
/// over it. Starts uniform, all zero bits.
class DenseBelief {
 public:
  DenseBelief(gpu::Context& context, gpu::CommandStream& stream, const PoseLattice& lattice,
              std::size_t objects);
  /// A uniform belief over the same lattice and objects.
  DenseBelief uniform() const { return {context_, stream_, lattice_, objects_}; }

  /// The slabs that a dense belief is cut into.
  static std::vector<SlabExtent> cut(const gpu::Context& context, const PoseLattice& lattice,
                                     std::size_t objects);

  /// Records the return to uniform.
  void clear() const;
  std::span<const Slab> slabs() const { return slabs_; }
  std::uint64_t device_bytes() const;

  // These run the stream.
  /// @param reuse memory for the result
  std::vector<BeliefSummary> summarise(std::vector<BeliefSummary> reuse = {}) const;
  /// Visits the bins of one object in the lattice's order, but for blocks of less than the choice's
  /// least share.
  void visit(std::size_t object, const BeliefSummary& summary, const BlockChoice& choice,
             const BinVisitor& visitor) const;
  /// The log-likelihoods of boxes of bins, one after another, each [y, x].
  std::vector<double> download(std::span<const BinBox> boxes) const;

 private:
  gpu::Context& context_;
  gpu::CommandStream& stream_;
  PoseLattice lattice_;
  std::size_t objects_;
  std::vector<Slab> slabs_;
  ReductionSizes reduction_;
  gpu::Kernel reduce_;
  gpu::Buffer partials_;  ///< of all slabs in order
  std::size_t partial_count_ = 0;
  mutable std::vector<shaders::Partial> read_partials_;  ///< memory that summarise() keeps
};

}  // namespace palpate
