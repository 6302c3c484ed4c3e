#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "estimation/bin_box.hpp"
#include "estimation/bounded/displaced/displacement_mean.hpp"
#include "estimation/bounded/tables/tile_bounds.hpp"
#include "estimation/displacement_weights.hpp"
#include "estimation/known_elements.hpp"
#include "estimation/log_sum.hpp"
#include "model/bounding_box.hpp"
#include "palpate/bounded_posterior.hpp"
#include "palpate/estimate.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// What a search is to reach; as BoundedOptions.
struct SearchGoal {
  double tolerance = 1e-6;
  std::optional<double> evidence_nats = {};
  double evidence_range_nats = std::numeric_limits<double>::infinity();
  /// See BoundedOptions::poor_bins.
  std::optional<std::int64_t> poor_bins = {};
};

/// When a search must end; never, where there is no budget. Whoever looks at it also gives the
/// caller of the search an opportunity to cancel it.
class Deadline {
 public:
  using Clock = std::chrono::steady_clock;

  /// @param cancel_point of BoundedOptions; outlives the deadline
  explicit Deadline(const std::optional<double>& budget_s,
                    const std::function<void()>* cancel_point = nullptr)
      : cancel_point_(cancel_point) {
    if (budget_s) {
      const std::chrono::duration<double> left(std::min(*budget_s, 1e9));  // which the clock counts
      at_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(left);
    }
  }
  bool exists() const { return at_.has_value(); }
  /// @throws what the cancel point throws
  bool passed() const {
    cancel_point();
    return at_ && Clock::now() >= *at_;
  }
  /// @throws what the cancel point throws
  void cancel_point() const {
    if (cancel_point_ != nullptr && *cancel_point_) {
      (*cancel_point_)();
    }
  }
  /// Lets it pass now, where there is a budget.
  void end() {
    if (at_) {
      at_ = Clock::time_point::min();
    }
  }

 private:
  std::optional<Clock::time_point> at_;
  const std::function<void()>* cancel_point_;
};

/// The summed likelihood of one hypothesis's bins: logs in nats, with its prior weight.
struct HypothesisMass {
  double evaluated = 0.0;  ///< of the bins that were evaluated
  double rounding = 0.0;   ///< bound of that sum's error
  double dropped = 0.0;    ///< bound of the sum over all other bins

  /// Bounds of the log of the sum over all bins.
  LogInterval bounds() const {
    return {log_subtract(evaluated, rounding), log_add(log_add(evaluated, rounding), dropped)};
  }
};

/// What a search by bounds returns.
struct SearchResult {
  std::vector<HypothesisMass> mass;  ///< [hypothesis]
  std::int32_t best_object = 0;
  std::int64_t best_bin = 0;
  double best_log_likelihood = 0.0;  ///< of the best bin, without prior weights
  bool mode_certain = false;
  /// The prior explains the elements far better than the best bin of any hypothesis.
  bool contradicted = false;
  std::int64_t blocks_bounded = 0;
  std::int64_t bins_evaluated = 0;

  /// The masses of all hypotheses together.
  HypothesisMass all() const {
    LogSum evaluated;
    LogSum rounding;
    LogSum dropped;
    for (const HypothesisMass& of : mass) {
      evaluated.add(of.evaluated);
      rounding.add(of.rounding);
      dropped.add(of.dropped);
    }
    return {evaluated.log(), rounding.log(), dropped.log()};
  }
  /// Bound of the mass that is not proven, relative to that which is evaluated.
  double unproven() const {
    const HypothesisMass of = all();
    return std::exp(log_add(of.rounding, of.dropped) - of.evaluated);
  }
};

/// The sizes of tiles of a search for these hypotheses.
std::vector<TileSize> tile_sizes(std::span<const Hypothesis> hypotheses,
                                 const BoundedOptions& options);

/// What searches through the poses of the same objects share: the levels of tiles, and the window
/// tables that bound the likelihood over them.
struct SearchSpace {
  /// @param options checked, with a resolved contact model
  SearchSpace(std::span<const Hypothesis> hypotheses, const BoundedOptions& options);

  /// Host memory, in bytes.
  std::uint64_t bytes() const;
  /// Index of the level of the smallest tiles.
  std::size_t finest_level() const { return bounds.front().levels().size() - 1; }

  std::vector<double> log_weight;     ///< [hypothesis] log of its prior weight, over their sum
  std::vector<std::size_t> label_of;  ///< [hypothesis] index of its label
  std::vector<glm::dvec2> turns;      ///< [theta] cosine and sine
  std::vector<OccupancyGrid> maps;    ///< [hypothesis] without their cells
  std::vector<BoundingBox> boxes;     ///< [hypothesis] around its occupied cells
  std::vector<TileBounds> bounds;     ///< [hypothesis]

  std::optional<DisplacementWeights> displacement;  ///< nothing where touches are undisplaced
  std::vector<DisplacementMean> displaced;          ///< [level] of tiles' bounds
};

/// Log-likelihood of elements without any penalty over the tiles of every level, in nats with the
/// prior weight, [hypothesis][level].
std::vector<std::vector<double>> unpenalised(const SearchSpace& space,
                                             const KnownElements& elements);

class BinLikelihood;
class LargestTiles;

/// What all parts of one search are given; it outlives them.
struct SearchTask {
  const SearchSpace& space;
  const BoundedOptions& options;    ///< checked, with a resolved contact model
  const BinLikelihood& likelihood;  ///< evaluates bins
  const KnownElements& elements;
  SearchGoal goal;
  const Deadline& deadline;  ///< after which tiles are dropped without being divided
  const BinVisitor& visit;
  std::vector<double> error = {};  ///< [hypothesis] BinLikelihood::error() of the elements
};

/// Finds the bins that hold all but a tolerated part of the posterior, by branch and bound: tiles
/// of poses are bounded by TileBounds, dropped where they hold too little, and divided otherwise,
/// until the smallest tiles' bins are evaluated in the order of their bounds. docs/bounds_inside.md
/// has the bound, its proof and the certificate.
/// @param largest has taken in the task's elements
/// @param refined where not null, takes the tiles that are divided
SearchResult run_search(SearchTask task, const LargestTiles& largest,
                        std::vector<PoseBlock>* refined = nullptr);

/// The bins of a tile of this level.
PoseBlock block_of(const BinBox& box, std::size_t level);

}  // namespace palpate
