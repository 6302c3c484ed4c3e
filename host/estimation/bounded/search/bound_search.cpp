#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "estimation/bounded/search/leaves.hpp"
#include "estimation/bounded/search/mass_account.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "estimation/bounded/search/tile_division.hpp"

namespace palpate {

namespace {

/// Part of the tolerance that dropped tiles may use up; the rest is a margin.
constexpr double search_share = 0.95;
/// Beam width during survey(), where all tiles of a level are looked at first.
constexpr std::size_t surveyed_tiles = 1024;
/// Tiles that survey() looks at where touches are displaced, those of the largest bounds: they tell
/// the total as well as all would, and closer looks cost more the wider the tiles lie apart.
constexpr std::size_t most_surveyed = 32768;
/// Tiles that are divided together: bounds the memory for their parts. More where touches are
/// displaced, since the parts of tiles that lie together share all within reach of them.
constexpr std::size_t most_undisplaced = 16384;
constexpr std::size_t most_displaced = 65536;

/// One run of a search, from the largest tiles to their bins.
class SearchRun {
 public:
  SearchRun(const SearchTask& task, const LargestTiles& largest, std::vector<PoseBlock>* refined)
      : task_(task),
        space_(task.space),
        goal_(task.goal),
        refined_(refined),
        finest_(space_.finest_level()),
        most_together_(space_.displacement ? most_displaced : most_undisplaced),
        division_(task, largest),
        account_(space_.log_weight, space_.label_of, task.options.lattice, goal_),
        leaves_(task, account_) {}

  SearchResult result() {
    settle_off_map();
    const std::vector<Tile> best = division_.best_of_largest();
    if (!best.empty()) {
      raise(best, 0);
      std::vector<Tile> tiles = division_.largest_above(negligible());
      drop_negligible();
      const double share = goal_.tolerance * search_share;
      // One part for every level that drops tiles, and one for the bins.
      const double used =
          drop(tiles, 0, share / static_cast<double>(std::max<std::size_t>(finest_, 1) + 1));
      divide(std::move(tiles), 0, share - used);
    }
    const bool contradicts = contradicted(best);
    SearchResult result = account_.result();
    result.contradicted = contradicts;
    result.blocks_bounded = division_.bounded();
    result.bins_evaluated = leaves_.bins();
    return result;
  }

 private:
  /// Settles the bins of all largest tiles in which every element sees the prior.
  void settle_off_map() {
    for (const BinBox& box : division_.off_map()) {
      settle_off_map(box);
    }
    account_.raise_totals();
  }

  /// Settles bins at which every element sees the prior.
  void settle_off_map(const BinBox& box) {
    const std::int64_t bins = box.bins();
    const auto object = static_cast<std::size_t>(box.object);
    const double value = division_.prior_log_likelihood(box.object);
    account_.settle(box.object, 1, value + std::log(static_cast<double>(bins)), value,
                    task_.error[object]);
    account_.note_best(box, 0, value);
    task_.visit(box, std::span(&value, 1));
  }

  /// Whether the prior explains the elements far better than the best bin of every hypothesis.
  /// @param best the largest tile of the largest bound of every object and theta
  bool contradicted(const std::vector<Tile>& best) {
    const double least =
        prior_log_likelihood(task_.elements, task_.options.contact) - contradiction_nats;
    const std::size_t objects = space_.bounds.size();
    const auto explains = [&](std::size_t i) { return account_.best_of(i) >= least; };
    for (std::size_t i = 0; i < objects; ++i) {
      if (explains(i)) {
        return false;
      }
    }
    // All touches count here, also where the last tiles could be dropped after a few.
    division_.set_negligible(-std::numeric_limits<double>::infinity());
    for (std::size_t i = 0; i < objects; ++i) {
      if (account_.largest_dropped_of(i) >= least) {
        // Too light a hypothesis to have been looked at.
        std::vector<Tile> own;
        std::ranges::copy_if(best, std::back_inserter(own), [&](const Tile& tile) {
          return tile.object == static_cast<std::int32_t>(i);
        });
        leaves_.look(division_.best_smallest(std::move(own), 0));
      }
      if (explains(i)) {
        return false;
      }
    }
    return true;
  }

  /// Raises the lower bound of the total: follows the best tiles down to their bins.
  /// @param width so many tiles at first
  void raise(std::vector<Tile> tiles, std::size_t level, std::size_t width = beam_tiles) {
    if (!goal_.evidence_nats) {
      leaves_.probe(division_.best_smallest(std::move(tiles), level, width));
      return;
    }
    // Every label's own total is wanted, too.
    std::vector<std::vector<Tile>> own(space_.bounds.size());
    for (const Tile& tile : tiles) {
      own[space_.label_of[tile.object]].push_back(tile);
    }
    std::vector<Tile> best;
    for (std::vector<Tile>& of_label : own) {
      const std::vector<Tile> found = division_.best_smallest(std::move(of_label), level, width);
      best.insert(best.end(), found.begin(), found.end());
    }
    leaves_.probe(std::move(best));
  }

  /// Divides tiles of a level until their bins are evaluated or dropped.
  /// @param tolerance part of the total that may be dropped
  void divide(std::vector<Tile> tiles, std::size_t level, double tolerance) {
    if (level == finest_) {
      leaves_.evaluate(tiles, tolerance);
      return;
    }
    if (tiles.size() > most_together_ && !leaves_.ended()) {
      // Tiles are divided one lot after another: the total must be known well before the first.
      survey(tiles, level);
      tolerance -= drop(tiles, level, tolerance / static_cast<double>(finest_ - level + 1));
      // Tiles that lie together share all within reach of displaced touches.
      std::ranges::sort(
          tiles, space_.displacement && !task_.deadline.exists() ? stands_before : larger_first);
    }
    double known_total = account_.log_total();
    for (std::size_t begin = 0; begin < tiles.size();) {
      if (account_.log_total() > known_total + 1.0) {
        tiles.erase(tiles.begin(), tiles.begin() + static_cast<std::ptrdiff_t>(begin));
        begin = 0;
        known_total = account_.log_total();
        tolerance -= drop(tiles, level, tolerance / 2.0);
        continue;
      }
      const std::size_t left = tiles.size() - begin;
      const auto first = tiles.begin() + static_cast<std::ptrdiff_t>(begin);
      if (leaves_.ended()) {
        account_.drop(unsettled({first, tiles.end()}, level, space_, account_));
        return;
      }
      const std::size_t count = std::min(most_together_, left);
      // What tiles do not use up is left for those after them.
      tolerance -= divide_lot({first, first + static_cast<std::ptrdiff_t>(count)}, level,
                              tolerance * static_cast<double>(count) / static_cast<double>(left));
      begin += count;
    }
  }

  /// Divides so many tiles that their parts fit the memory for them.
  /// @returns the part of the total that was dropped
  double divide_lot(std::vector<Tile> tiles, std::size_t level, double tolerance) {
    if (refined_ != nullptr) {
      for (const Tile& tile : tiles) {
        refined_->push_back(
            block_of(space_.bounds[tile.object].levels()[level].box_of(tile), level));
      }
    }
    std::ranges::sort(tiles, stands_before);
    std::vector<Tile> off_map;
    division_.set_negligible(std::max(negligible(), droppable(tiles, level, tolerance)));
    std::vector<Tile> parts = division_.parts_of(tiles, level, &off_map);
    for (const Tile& tile : off_map) {
      settle_off_map(space_.bounds[tile.object].levels()[level + 1].box_of(tile));
    }
    const double dropped = account_.dropped_share();
    double used = 0.0;
    if (level + 1 < finest_) {
      raise(parts, level + 1);
      used = drop(parts, level + 1, tolerance / static_cast<double>(finest_ - level));
    }
    divide(std::move(parts), level + 1, std::max(tolerance - used, 0.0));
    return used_of(tolerance, dropped);
  }

  /// A bound, in nats: all bins together, if none exceeded it, would hold nothing beside the
  /// tolerance.
  double negligible() const {
    constexpr double part = 1e-3;
    const double bins = static_cast<double>(task_.options.lattice.bins()) *
                        static_cast<double>(space_.bounds.size());
    // Where every label's own total is wanted, none is negligible beside all.
    return goal_.evidence_nats
               ? -std::numeric_limits<double>::infinity()
               : std::min(account_.log_total() + std::log(part * goal_.tolerance / bins),
                          account_.best());
  }

  /// Where touches are displaced, a bound in nats: if no part of these tiles exceeded it, all could
  /// be dropped, and little of what may be dropped would be used up.
  /// @param tolerance see divide_lot()
  double droppable(std::span<const Tile> tiles, std::size_t level, double tolerance) const {
    if (goal_.evidence_nats || !space_.displacement) {
      return -std::numeric_limits<double>::infinity();
    }
    constexpr double part = 0.1;
    std::int64_t bins = 0;
    for (const Tile& tile : tiles) {
      bins += space_.bounds[tile.object].bins(level, tile);
    }
    const double of_level = tolerance / static_cast<double>(finest_ - level);
    return std::min(account_.log_total() + std::log(part * of_level / static_cast<double>(bins)),
                    account_.best());
  }

  /// Drops the largest tiles of negligible bounds, as if all bins were there.
  void drop_negligible() {
    if (const double bound = negligible(); std::isfinite(bound)) {
      UnsettledMass mass(space_.bounds.size(), bound);
      for (std::size_t i = 0; i < space_.bounds.size(); ++i) {
        mass.add(i, bound, task_.options.lattice.bins());
      }
      account_.drop(mass);
    }
  }

  /// Lowers the bounds of tiles, or of the best of them, to those of their parts, and follows the
  /// best parts down to their bins.
  void survey(std::vector<Tile>& tiles, std::size_t level) {
    const auto first = tiles.begin();
    auto end = tiles.end();
    if (space_.displacement && tiles.size() > most_surveyed) {
      end = first + most_surveyed;
      std::nth_element(first, end, tiles.end(), larger_first);
    }
    std::sort(first, end, stands_before);
    const std::span<Tile> surveyed(first, end);
    std::vector<Tile> best;
    for (std::size_t begin = 0; begin < surveyed.size(); begin += most_together_) {
      const auto lot = surveyed.subspan(begin, std::min(most_together_, surveyed.size() - begin));
      task_.deadline.cancel_point();
      division_.set_negligible(negligible());
      std::vector<Tile> parts = division_.parts_of(lot, level);
      std::size_t next = 0;
      for (Tile& tile : lot) {
        double largest =
            space_.log_weight[tile.object] + division_.prior_log_likelihood(tile.object);
        for (; next < parts.size() && is_part(parts[next], tile); ++next) {
          largest = std::max(largest, parts[next].bound);
        }
        tile.bound = std::min(tile.bound, largest);
      }
      keep_best(parts, surveyed_tiles);
      best.insert(best.end(), parts.begin(), parts.end());
      keep_best(best, surveyed_tiles);
    }
    raise(std::move(best), level + 1, surveyed_tiles);
  }

  /// Drops tiles that hold at most this part of the total together.
  /// @returns the part of the total that was dropped
  double drop(std::vector<Tile>& tiles, std::size_t level, double tolerance) {
    const double dropped = account_.dropped_share();
    UnsettledMass mass = unsettled(tiles, level, space_, account_);
    const std::vector<std::size_t> from = account_.droppable_from(mass, tolerance);
    std::erase_if(tiles,
                  [&](const Tile& tile) { return mass.slot(tile.bound) >= from[tile.object]; });
    for (const Tile& tile : tiles) {
      mass.remove(static_cast<std::size_t>(tile.object), tile.bound,
                  space_.bounds[tile.object].bins(level, tile));
    }
    account_.drop(mass);
    return used_of(tolerance, dropped);
  }

  /// What dropping tiles used up of a tolerance, given what was dropped before.
  double used_of(double tolerance, double dropped_before) const {
    // Where each hypothesis has its own share, a light one may have used it up.
    return goal_.evidence_nats
               ? tolerance
               : std::clamp(account_.dropped_share() - dropped_before, 0.0, tolerance);
  }

  const SearchTask& task_;
  const SearchSpace& space_;
  const SearchGoal& goal_;
  std::vector<PoseBlock>* refined_;
  std::size_t finest_;         ///< level
  std::size_t most_together_;  ///< tiles that are divided
  TileDivision division_;
  MassAccount account_;
  Leaves leaves_;
};

}  // namespace

SearchResult run_search(SearchTask task, const LargestTiles& largest,
                        std::vector<PoseBlock>* refined) {
  for (std::size_t i = 0; i < task.space.bounds.size(); ++i) {
    task.error.push_back(task.likelihood.error(i, task.elements));
  }
  // What rounding leaves may be used up.
  double& tolerance = task.goal.tolerance;
  tolerance = std::max(tolerance - 1.1 * std::ranges::max(task.error), tolerance / 4.0);
  return SearchRun(task, largest, refined).result();
}

PoseBlock block_of(const BinBox& box, std::size_t level) {
  return {.object = box.object,
          .level = static_cast<int>(level),
          .theta = box.theta,
          .x_first = box.x_first,
          .x_count = box.x_count,
          .y_first = box.y_first,
          .y_count = box.y_count};
}

}  // namespace palpate
