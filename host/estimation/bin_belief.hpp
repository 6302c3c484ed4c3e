#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "estimation/bin_box.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// A belief over objects and the bins of a lattice, and what can be asked of it: of a histogram as
/// of the bins that a search by bounds evaluated.
struct BinBelief {
  /// An object's part of the belief. Log-likelihoods may be so large that adding the log of a sum
  /// to them loses its digits. So a bin's log-likelihood is taken relative to `reference` first.
  struct Object {
    double reference = 0.0;     ///< a log-likelihood, in nats
    double log_share = 0.0;     ///< log of the share of the object's belief that such a bin holds
    double log_identity = 0.0;  ///< log of the object's probability, "none of these" left out

    /// Log of the share of the object's belief that a bin holds.
    double log_share_of(double log_likelihood) const {
      return (log_likelihood - reference) + log_share;
    }
  };

  const PoseLattice& lattice;
  std::vector<Object> objects;
  /// Log of the probability of all objects together: below 0 beside "none of these".
  double log_objects = 0.0;
  /// Visits the bins of these objects, each once, but for those that the choice leaves out.
  std::function<void(std::span<const int>, const BlockChoice&, const BinVisitor&)> visit;

  /// Probabilities of an object's poses on a grid; a bin counts in the grid's nearest bin
  /// (PoseLattice::bin_of()). Those of all objects and "none of these" together sum to 1.
  /// @throws Error where there is no such object, or on a grid that is not sound
  Marginals marginals(int object, PoseLattice grid) const;
  /// The bins that hold at least this share of their object's belief, [asked].
  /// @throws Error where there is no such object
  std::vector<std::vector<BinShare>> likely_bins(std::span<const int> asked,
                                                 double least_share) const;
  /// Entropy over objects and bins in nats, "none of these" left out.
  double entropy() const;
  /// Draws objects and poses, "none of these" left out, in the order of objects and bins: a bin in
  /// each of `count` equal parts of the belief, and a pose anywhere in the bin.
  std::vector<PoseSample> sample(std::size_t count, std::uint64_t seed) const;

 private:
  /// The objects that hold a part of the belief.
  std::vector<int> likely_objects() const;
};

}  // namespace palpate
