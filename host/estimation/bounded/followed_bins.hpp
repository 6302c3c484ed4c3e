#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "estimation/bounded/evaluated_bins.hpp"
#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "estimation/bounded/search/mass_account.hpp"

namespace palpate {

/// The bins that held nearly all of a belief, followed through more touches without a search: after
/// a touch that surprises nobody they still do.
class FollowedBins {
 public:
  /// More bins would take longer than a search.
  static constexpr std::size_t most_bins = 1 << 14;

  /// @param bins,found of one search; all bins that it evaluated
  /// @param log_weight [hypothesis] log of its prior weight
  FollowedBins(const EvaluatedBins& bins, const SearchResult& found,
               std::span<const double> log_weight);

  /// Takes in the elements of more touches.
  /// @param most [hypothesis] log-likelihood that no pose exceeds, in nats
  void add(const KnownElements& elements, const BinLikelihood& likelihood,
           std::span<const double> most);

  /// Bound of the mass of all other bins, relative to that of these.
  double share_outside() const;
  /// Log of the summed likelihood of the bins, with prior weights.
  double log_total() const { return log_total_; }
  void visit(const BinVisitor& visit) const;

 private:
  void add_up();

  std::vector<double> log_weight_;
  std::vector<BinBox> boxes_;
  std::vector<double> values_;   ///< log-likelihoods, [box][bin]
  std::vector<double> outside_;  ///< [hypothesis] log of the bound, with the prior weight
  double log_total_ = 0.0;
};

}  // namespace palpate
