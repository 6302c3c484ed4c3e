#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "estimation/bounded/search/search_goal.hpp"

namespace palpate {

/// Keeps the bins that a search evaluated, as far as there is room for them.
class EvaluatedBins {
 public:
  /// @param keeps_all also beyond its room: the search ends soon after full()
  explicit EvaluatedBins(bool keeps_all = false) : keeps_all_(keeps_all) {}
  void clear() { *this = EvaluatedBins(keeps_all_); }
  /// See BinVisitor.
  void add(const BinBox& box, std::span<const double> log_likelihood);
  /// False where there was no room for all.
  bool complete() const { return complete_; }
  /// There is no room for more.
  bool full() const { return bytes_used() > most_bytes; }
  void visit(const BinVisitor& visit) const;
  std::span<const BinBox> boxes() const { return boxes_; }
  /// The log-likelihoods that are kept, box after box.
  std::span<double> values() { return values_; }
  std::span<const double> values() const { return values_; }

  std::uint64_t bytes() const {
    return boxes_.capacity() * sizeof(BinBox) + values_.capacity() * sizeof(double) +
           value_counts_.capacity() * sizeof(std::uint32_t);
  }

 private:
  /// Together with the vectors' growth within some 160 MiB.
  static constexpr std::uint64_t most_bytes = std::uint64_t{80} << 20;

  std::uint64_t bytes_used() const {
    return boxes_.size() * (sizeof(BinBox) + sizeof(std::uint32_t)) +
           values_.size() * sizeof(double);
  }

  bool keeps_all_;
  std::vector<BinBox> boxes_;
  std::vector<std::uint32_t> value_counts_;  ///< [box]
  std::vector<double> values_;
  bool complete_ = true;
};

/// The bins that held nearly all of a belief, followed through more touches without a search: after
/// a touch that surprises nobody they still do.
class FollowedBins {
 public:
  /// More bins would take longer than a search, which takes long where touches are displaced.
  static std::size_t most_bins(const BinLikelihood& likelihood) {
    return likelihood.displaced() ? 1 << 16 : 1 << 14;
  }

  /// @param bins,found of one search; all bins that it evaluated
  /// @param log_weight [hypothesis] log of its prior weight
  /// @param touches that the search took in
  FollowedBins(const EvaluatedBins& bins, const SearchResult& found,
               std::span<const double> log_weight, std::size_t touches);

  /// Touches that were taken in.
  std::size_t touches() const { return touches_; }
  /// Takes in the elements of one more touch.
  /// @param most [hypothesis] log-likelihood that no pose exceeds, in nats
  void add(const KnownElements& elements, const BinLikelihood& likelihood,
           std::span<const double> most);

  /// Bound of the mass of all other bins, relative to that of these.
  double share_outside() const;
  /// Log of the summed likelihood of the bins, with prior weights.
  double log_total() const { return log_total_; }
  void visit(const BinVisitor& visit) const { bins_.visit(visit); }

 private:
  void add_up();

  std::vector<double> log_weight_;
  std::size_t touches_;
  EvaluatedBins bins_{true};
  std::vector<double> outside_;  ///< [hypothesis] log of the bound, with the prior weight
  double log_total_ = 0.0;
};

}  // namespace palpate
