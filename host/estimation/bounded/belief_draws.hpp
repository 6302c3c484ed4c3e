#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimation/bin_box.hpp"
#include "model/random.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// Draws poses from a belief whose bins come box by box, one in each of `count` equal parts of the
/// belief.
class BeliefDraws {
 public:
  /// @param lattice,log_weight outlive this object; log_weight is [hypothesis], the log of its
  /// prior weight
  /// @param log_total log of the summed likelihood of all bins to come, with prior weights
  BeliefDraws(std::size_t count, std::uint64_t seed, const PoseLattice& lattice,
              std::span<const double> log_weight, double log_total);

  /// See BinVisitor.
  void add(const BinBox& box, std::span<const double> log_likelihood);
  /// The draws, uniform within their bins, in the order of objects and bins.
  std::vector<PoseSample> take();

 private:
  struct Draw {
    std::int32_t object = 0;
    std::int64_t bin = 0;
  };

  /// Whether a draw is due before the belief has reached so much.
  bool is_due(double reached) const {
    return draws_.size() < targets_.size() && targets_[draws_.size()] < reached;
  }

  const PoseLattice& lattice_;
  std::span<const double> log_weight_;
  double log_total_;
  Random random_;
  std::vector<double> targets_;  ///< ascending, as parts of the belief
  std::vector<Draw> draws_;
  double reached_ = 0.0;  ///< part of the belief that has come
  Draw last_;             ///< the last bin that has come
};

}  // namespace palpate
