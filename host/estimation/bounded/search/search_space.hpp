#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "estimation/bounded/displaced/displacement_mean.hpp"
#include "estimation/bounded/search/search_goal.hpp"
#include "estimation/bounded/tables/tile_bounds.hpp"
#include "estimation/displacement_weights.hpp"
#include "estimation/known_elements.hpp"
#include "model/bounding_box.hpp"
#include "palpate/bounded_posterior.hpp"
#include "palpate/estimate.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

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

  std::optional<DisplacementWeights> displacement;  ///< nothing where touches are exact
  std::vector<DisplacementMean> displaced;          ///< [level] of tiles' bounds
};

/// Log-likelihood of elements without any penalty over the tiles of every level, in nats with the
/// prior weight, [hypothesis][level].
std::vector<std::vector<double>> unpenalised(const SearchSpace& space,
                                             const KnownElements& elements);

class BinLikelihood;

/// What all parts of one search are given; it outlives them.
struct SearchTask {
  const SearchSpace& space;
  const BoundedOptions& options;    ///< checked, with a resolved contact model
  const BinLikelihood& likelihood;  ///< evaluates bins
  const KnownElements& elements;
  std::span<const double> error;  ///< [hypothesis] BinLikelihood::error() of the elements
  const SearchGoal& goal;
  const Deadline& deadline;  ///< after which tiles are dropped unseen
  const BinVisitor& visit;
};

}  // namespace palpate
