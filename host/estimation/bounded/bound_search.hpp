#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "bin_likelihood.hpp"
#include "known_elements.hpp"
#include "leaf_evaluator.hpp"
#include "palpate/bounded_posterior.hpp"
#include "tile_bounds.hpp"

namespace palpate {

/// Finds the bins that hold all but a tolerated part of the posterior, by branch and bound: tiles
/// of poses are bounded by TileBounds, dropped where they hold too little, and divided otherwise,
/// until the smallest tiles' bins are evaluated in the order of their bounds.
class BoundSearch {
 public:
  /// @param options checked, with a resolved contact model
  /// @param likelihood,batches evaluate bins; they outlive the search
  BoundSearch(std::span<const Hypothesis> hypotheses, const BoundedOptions& options,
              const BinLikelihood& likelihood, FasterBinLikelihood& batches);

  /// Forgets all touches.
  void reset();
  /// Adds the penalties of more touches to the sums of the largest tiles.
  /// @param touches [touch]
  void add(std::span<const KnownElements> touches);
  /// @param elements all that were added since reset()
  /// @param deadline after which tiles are dropped unseen
  /// @param refined where not null, takes the tiles that were divided
  SearchResult run(const KnownElements& elements, const SearchGoal& goal, const Deadline& deadline,
                   const BinVisitor& visit, std::vector<PoseBlock>* refined = nullptr) const;

  /// [hypothesis]
  std::span<const TileBounds> bounds() const { return bounds_; }
  /// The level of the smallest tiles, 0 that of the largest.
  int finest_level() const { return static_cast<int>(bounds_.front().levels().size()) - 1; }
  std::uint64_t bytes() const;

 private:
  friend class SearchRun;

  void add(const KnownElements& added);

  const BoundedOptions& options_;
  const BinLikelihood& likelihood_;
  FasterBinLikelihood& batches_;
  std::vector<double> log_weight_;
  std::vector<std::size_t> label_of_;  ///< [hypothesis] index of its label
  std::vector<glm::dvec2> turns_;      ///< [theta] cosine and sine
  std::vector<OccupancyGrid> maps_;    ///< [hypothesis] without their cells
  std::vector<TileBounds> bounds_;     ///< [hypothesis]
  /// Sums of penalties of the largest tiles, [hypothesis][theta, batch y, batch x, tile], less
  /// those of a tile in which every element sees the prior.
  std::vector<std::vector<std::int32_t>> largest_tiles_;
  std::vector<std::int64_t> unseen_;  ///< [hypothesis] these
};

}  // namespace palpate
