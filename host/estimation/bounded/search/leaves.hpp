#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "estimation/bounded/search/mass_account.hpp"
#include "estimation/bounded/search/search_space.hpp"

namespace palpate {

/// Bins that are evaluated together at most, but for the last tile's: limits the memory for them.
inline constexpr std::size_t largest_batch = 500'000;

/// The last step of a search by bounds: evaluates the bins of the smallest tiles in the order of
/// their bounds, as boxes, the leaves.
class Leaves {
 public:
  /// @param task,account outlive the leaves
  Leaves(const SearchTask& task, MassAccount& account);

  /// Evaluates the bins of a few tiles ahead of the others, to learn how much mass there is at
  /// least.
  void probe(std::vector<Tile> tiles);
  /// Evaluates the bins of a few tiles only to learn how likely the best one is.
  void look(std::span<const Tile> tiles);
  /// Evaluates the bins of tiles of the finest level, until those left hold at most this part of
  /// the total; drops these.
  void evaluate(std::span<const Tile> tiles, double tolerance);
  /// Number of bins that were evaluated.
  std::int64_t bins() const { return bins_; }
  /// Whether the search is to end with what it has proven.
  bool ended() const {
    return task_.deadline.passed() || (task_.goal.poor_bins && bins_ >= *task_.goal.poor_bins &&
                                       account_.best() < poor_below_);
  }

 private:
  /// Parts of one tile. Those that are needed are evaluated together, as one box with those between
  /// them: fuller vectors.
  struct Family {
    std::span<const Tile> tiles;
    std::size_t slot = UnsettledMass::slots;  ///< of the largest bound
    bool probed = false;                      ///< one of them was evaluated
  };
  struct Leaf {
    BinBox box;
    std::span<const double> values;  ///< until others are evaluated
    double log_mass = 0.0;           ///< without the prior weight
    double largest = 0.0;
  };

  const TileLevel& level_of(const Tile& tile) const {
    return task_.space.bounds[tile.object].levels().back();
  }
  std::vector<BinBox> boxes_of(std::span<const Tile> tiles) const;
  bool probed(const Tile& tile) const;
  void remove(const Tile& tile, UnsettledMass& left) const {
    left.remove(static_cast<std::size_t>(tile.object), tile.bound,
                level_of(tile).box_of(tile).bins());
  }
  /// The families of tiles that are sorted by place. Removes those that were probed from what is
  /// left.
  std::vector<Family> families_of(std::span<const Tile> tiles, UnsettledMass& left) const;
  /// Takes a family's tiles before the slots `from`, [object], out of what is left, as boxes.
  void take(const Family& family, std::span<const std::size_t> from, UnsettledMass& left,
            std::vector<BinBox>& boxes) const;
  /// Evaluates the bins of boxes.
  /// @returns the leaves, sorted by place, with the sums of their bins
  std::vector<Leaf> evaluated(std::vector<BinBox> boxes);
  /// Evaluates the bins of boxes and settles them.
  void add(std::vector<BinBox> boxes);

  const SearchTask& task_;
  MassAccount& account_;
  bool displaced_;              ///< touches are displaced
  std::vector<Tile> probed_;    ///< sorted by place
  double poor_below_;           ///< see BoundedOptions::poor_bins
  std::vector<double> values_;  ///< of the leaves that were evaluated last
  std::int64_t bins_ = 0;
};

/// The bins of tiles of a level, by the tiles' bounds.
UnsettledMass unsettled(std::span<const Tile> tiles, std::size_t level, const SearchSpace& space,
                        const MassAccount& account);

}  // namespace palpate
