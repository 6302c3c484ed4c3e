#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimation/bounded/search/leaf_evaluator.hpp"
#include "estimation/bounded/search/mass_account.hpp"
#include "estimation/bounded/tables/tile_bounds.hpp"

namespace palpate {

/// Bins that are evaluated together at most, but for the last tile's: limits the memory for them.
inline constexpr std::int64_t largest_batch = 500'000;

/// The last step of a search by bounds: evaluates the bins of the smallest tiles in the order of
/// their bounds.
class LeafPass {
 public:
  /// @param thetas of the lattice
  LeafPass(std::span<const TileBounds> bounds, std::size_t thetas, std::size_t elements,
           const Deadline& deadline, MassAccount& account, LeafEvaluator& evaluator);

  /// Evaluates the bins of a few tiles ahead of the others, to learn how much mass there is at
  /// least.
  void probe(std::vector<Tile> tiles);
  /// Evaluates the bins of tiles of the finest level, until those left hold at most this part of
  /// the total; drops these.
  void evaluate(std::span<const Tile> tiles, double tolerance);
  /// Tiles of the finest level as boxes of bins.
  std::vector<BinBox> boxes_of(std::span<const Tile> tiles) const;

 private:
  /// The parts of one tile, [first, end) of a list. Those that are needed are evaluated together,
  /// as one box with those between them: fuller vectors.
  struct Family {
    std::size_t first = 0;
    std::size_t end = 0;
    double bound = 0.0;  ///< the largest
  };

  std::vector<Family> families_of(std::span<const Tile> tiles) const;
  bool probed(const Tile& tile) const;
  void remove(const Tile& tile, UnsettledMass& left) const;
  /// Takes a family's tiles before the slots `from` out of what is left, as boxes.
  void take_family(std::span<const Tile> family, const std::vector<std::size_t>& from,
                   UnsettledMass& left, std::vector<BinBox>& boxes) const;
  void evaluate_boxes(std::vector<BinBox> boxes);

  std::span<const TileBounds> bounds_;
  std::size_t thetas_;
  std::int64_t elements_;  ///< one more than there are
  const Deadline& deadline_;
  MassAccount& account_;
  LeafEvaluator& evaluator_;
  std::vector<Tile> probed_;         ///< sorted by place
  std::vector<bool> probed_in_row_;  ///< [object, theta]
};

/// Sorts before another by object, theta, y, x.
bool stands_before(const Tile& a, const Tile& b);

/// The bins of tiles, by the tiles' bounds.
UnsettledMass unsettled(std::span<const Tile> tiles, std::size_t level,
                        std::span<const TileBounds> bounds, const MassAccount& account);

}  // namespace palpate
