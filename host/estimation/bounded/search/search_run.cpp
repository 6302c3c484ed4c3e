// One run of a BoundSearch, from the largest tiles to their bins.

#include "estimation/bounded/search/bound_search.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <tuple>

#include "estimation/bounded/parallel_for.hpp"
#include "estimation/bounded/search/leaf_pass.hpp"
#include "estimation/bounded/search/seen_window.hpp"
#include "estimation/bounded/search/unsettled_mass.hpp"
#include "estimation/bounded/touch_overlap.hpp"
#include "estimation/contradiction.hpp"

namespace palpate {

namespace {

constexpr double nothing = -std::numeric_limits<double>::infinity();
/// Tiles that are followed down to the bins, to know early how much mass there is at least.
constexpr std::size_t beam_tiles = 64;
/// The same where all tiles of a level are looked at first.
constexpr std::size_t surveyed_tiles = 1024;
/// Of these, so many of the smallest have their bins evaluated.
constexpr std::size_t probed_tiles = 16;
/// Largest tiles that are divided together: bounds the memory for their parts.
constexpr std::size_t most_together = 16384;
/// Tiles of one theta that a task divides.
constexpr std::size_t tiles_per_task = 64;

bool before(const Tile& a, const Tile& b) {
  if (a.bound != b.bound) {
    return a.bound > b.bound;
  }
  return std::tie(a.object, a.theta, a.y, a.x) < std::tie(b.object, b.theta, b.y, b.x);
}

/// Keeps the tiles of the largest bounds.
void keep_best(std::vector<Tile>& tiles, std::size_t count) {
  if (tiles.size() > count) {
    std::nth_element(tiles.begin(), tiles.begin() + static_cast<std::ptrdiff_t>(count), tiles.end(),
                     before);
    tiles.resize(count);
  }
}

}  // namespace

/// One run of the search.
class SearchRun {
 public:
  SearchRun(const BoundSearch& search, const KnownElements& elements, const SearchGoal& goal,
            const Deadline& deadline, const BinVisitor& visit, std::vector<PoseBlock>* refined)
      : search_(search),
        space_(search.space_),
        lattice_(search.options_.lattice),
        elements_(elements),
        reaches_(reaches_of(elements, search.space_.turns)),
        refined_(refined),
        thetas_(static_cast<std::size_t>(lattice_.theta_rad.count)),
        finest_(search.space_.bounds.front().levels().size() - 1),
        goal_(goal),
        deadline_(deadline),
        account_(search.space_.log_weight, search.space_.label_of, lattice_, goal_),
        evaluator_(search.likelihood_, search.space_.log_weight, goal_, elements, visit, deadline_,
                   account_),
        leaves_(search.space_.bounds, thetas_, elements.from_pivot_mm.size(), deadline_, account_,
                evaluator_),
        visit_(visit) {
    for (std::size_t i = 0; i < space_.bounds.size(); ++i) {
      std::vector<double> of_level;
      for (std::size_t level = 0; level <= finest_; ++level) {
        of_level.push_back(space_.log_weight[i] + space_.bounds[i].best(level, elements));
      }
      unpenalised_.push_back(std::move(of_level));
      double prior = 0.0;
      for (const ReadingRun& run : elements.runs) {
        const ContactModel& contact = search_.options_.contact;
        prior +=
            static_cast<double>(run.end - run.begin) *
            contact.log_likelihood(run.reading, {log_odds_from_probability(*contact.prior)}, i);
      }
      prior_log_likelihoods_.push_back(prior);
    }
  }

  SearchResult result() {
    settle_unseen();
    const std::vector<Tile> best = best_of_rows();
    if (!best.empty()) {
      raise(best, 0);
      const double largest = std::min_element(best.begin(), best.end(), before)->bound;
      UnsettledMass unsettled(space_.bounds.size(), largest, account_.slot_nats(largest));
      count_largest(unsettled);
      const double share = goal_.tolerance * search_share;
      // One part for every level that drops tiles, and one for the bins.
      const double part = share / static_cast<double>(std::max<std::size_t>(finest_, 1) + 1);
      std::vector<Tile> kept = keep_largest(unsettled, part);
      account_.drop(unsettled);
      divide(std::move(kept), 0, share - used_of(part, 0.0));
    }
    const bool contradicts = goal_.mode && contradicted(best);
    evaluator_.flush();
    SearchResult result = account_.result();
    result.contradicted = contradicts;
    result.blocks_bounded = blocks_;
    result.bins_evaluated = evaluator_.bins();
    return result;
  }

 private:
  /// Part of the tolerance that dropped tiles may use up; the rest is for rounding.
  static constexpr double search_share = 0.75;

  /// Whether the prior explains the elements far better than the best bin of every hypothesis.
  /// @param best the largest tile of the largest bound of every object and theta
  bool contradicted(const std::vector<Tile>& best) {
    double prior = 0.0;
    for (const ReadingRun& run : elements_.runs) {
      prior += static_cast<double>(run.end - run.begin) *
               prior_log_likelihood(run.reading, search_.options_.contact);
    }
    const double least = prior - contradiction_nats;
    const std::size_t objects = space_.bounds.size();
    const auto explains = [&](std::size_t i) { return account_.best_of(i) >= least; };
    for (std::size_t i = 0; i < objects; ++i) {
      if (explains(i)) {
        return false;
      }
    }
    for (std::size_t i = 0; i < objects; ++i) {
      if (account_.largest_dropped_of(i) >= least) {
        // Too light a hypothesis to have been looked at.
        for (const BinBox& box :
             leaves_.boxes_of(best_of_beam(of_object(best, i), 0, beam_tiles))) {
          evaluator_.look(box);
        }
      }
      if (explains(i)) {
        return false;
      }
    }
    return true;
  }

  static std::vector<Tile> of_object(const std::vector<Tile>& tiles, std::size_t object) {
    std::vector<Tile> own;
    std::copy_if(tiles.begin(), tiles.end(), std::back_inserter(own), [&](const Tile& tile) {
      return tile.object == static_cast<std::int32_t>(object);
    });
    return own;
  }

  /// Finds the largest tiles where an element may see something else than the prior, and settles
  /// all other bins, which have the likelihood of the prior.
  void settle_unseen() {
    seen_.resize(space_.bounds.size() * thetas_);
    parallel_for(seen_.size(), [&](std::size_t row) {
      const std::size_t object = row / thetas_;
      seen_[row] = seen_window(reaches_[row % thetas_], space_.maps[object],
                               space_.bounds[object].levels().front());
    });
    for (std::size_t row = 0; row < seen_.size(); ++row) {
      const std::size_t object = row / thetas_;
      const TileLevel& level = space_.bounds[object].levels().front();
      const TileWindow& seen = seen_[row];
      const auto settle = [&](int x_first, int x_end, int y_first, int y_end) {
        const BinBox box = level.box_of(static_cast<std::int32_t>(object),
                                        static_cast<std::int32_t>(row % thetas_),
                                        {x_first, x_end, y_first, y_end});
        settle_unseen(box);
      };
      const int nx = level.x.tiles();
      settle(0, nx, 0, seen.y_first);
      settle(0, seen.x_first, seen.y_first, seen.y_end);
      settle(seen.x_end, nx, seen.y_first, seen.y_end);
      settle(0, nx, seen.y_end, level.y.tiles());
    }
    account_.raise_totals(std::vector<LogSum>(space_.bounds.size()));
  }

  /// Settles bins at which every element sees the prior.
  void settle_unseen(const BinBox& box) {
    const std::int64_t bins = goal_.counted != nullptr ? goal_.counted->bins(box) : box.bins();
    if (bins == 0) {
      return;
    }
    const auto object = static_cast<std::size_t>(box.object);
    const double value = prior_log_likelihoods_[object];
    account_.settle(box.object, 1, value + std::log(static_cast<double>(bins)), value,
                    search_.likelihood_.float64_error(object, elements_));
    account_.note_best(box, 0, value);
    visit_(box, std::span(&value, 1));
  }

  /// Whether any bin of a tile may count.
  bool may_count(const TileLevel& level, const Tile& tile) const {
    return goal_.counted == nullptr || goal_.counted->may_hold(level.box_of(tile));
  }

  /// Calls visit(sum, x, y, bins) for the largest tiles of a row, a theta of an object, that hold
  /// bins and see the map, with the sums of their penalties as the search keeps them.
  template <typename Visit>
  void for_row(std::size_t row, const Visit& visit) const {
    const std::size_t object = row / thetas_;
    const TileLevel& level = space_.bounds[object].levels().front();
    const TileWindow& seen = seen_[row];
    const auto batches = static_cast<std::size_t>(level.batches_x()) * level.batches_y();
    const std::int32_t* sums =
        search_.largest_tiles_[object].data() + row % thetas_ * batches * batch_tiles;
    for (int y = seen.y_first; y < seen.y_end; ++y) {
      const std::int64_t rows = level.y.bins(y);
      const std::int32_t* of_y =
          sums + std::ptrdiff_t{y / batch_side} * level.batches_x() * batch_tiles + y % batch_side;
      for (int x = seen.x_first; x < seen.x_end; ++x) {
        const std::int64_t bins = rows * level.x.bins(x);
        if (bins > 0 && may_count(level, {.object = static_cast<std::int32_t>(object),
                                          .theta = static_cast<std::int32_t>(row % thetas_),
                                          .x = x,
                                          .y = y})) {
          visit(of_y[std::ptrdiff_t{batch_side} * x], x, y, bins);
        }
      }
    }
  }

  /// The bound of a largest tile, from the sum that the search keeps.
  double bound_of(std::size_t object, std::int32_t sum) const {
    return unpenalised_[object][0] -
           static_cast<double>(search_.unseen_[object] + sum) / penalties_per_nat;
  }

  /// The largest tile of the largest bound of every object and theta.
  std::vector<Tile> best_of_rows() {
    std::vector<Tile> best(seen_.size(), {.bound = nothing});
    std::vector<std::int64_t> counts(seen_.size());
    parallel_for(best.size(), [&](std::size_t row) {
      std::int64_t count = 0;
      std::int32_t least = std::numeric_limits<std::int32_t>::max();  // more than any sum
      Tile at;
      for_row(row, [&](std::int32_t sum, int x, int y, std::int64_t /*bins*/) {
        ++count;
        if (sum < least) {
          least = sum;
          at.x = x;
          at.y = y;
        }
      });
      counts[row] = count;
      if (count > 0) {
        best[row] = {bound_of(row / thetas_, least), static_cast<std::int32_t>(row / thetas_),
                     static_cast<std::int32_t>(row % thetas_), at.x, at.y};
      }
    });
    blocks_ += std::accumulate(counts.begin(), counts.end(), std::int64_t{0});
    std::erase_if(best, [](const Tile& tile) { return tile.bound == nothing; });
    return best;
  }

  void count_largest(UnsettledMass& unsettled) const {
    parallel_for(space_.bounds.size(), [&](std::size_t object) {
      for (std::size_t theta = 0; theta < thetas_; ++theta) {
        for_row(object * thetas_ + theta,
                [&](std::int32_t sum, int /*x*/, int /*y*/, std::int64_t bins) {
                  unsettled.add(object, bound_of(object, sum), bins);
                });
      }
    });
  }

  /// The least sum of a largest tile whose slot is not before this one: slots ascend with sums.
  std::int64_t least_sum(const UnsettledMass& unsettled, std::size_t object,
                         std::size_t slot) const {
    std::int64_t low = std::numeric_limits<std::int32_t>::min();
    std::int64_t high = std::int64_t{std::numeric_limits<std::int32_t>::max()} + 1;
    while (low < high) {
      const std::int64_t middle = low + (high - low) / 2;
      if (unsettled.slot(bound_of(object, static_cast<std::int32_t>(middle))) < slot) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    return low;
  }

  /// The largest tiles that must be divided, and takes them out of the unsettled ones.
  std::vector<Tile> keep_largest(UnsettledMass& unsettled, double share) const {
    const std::vector<std::size_t> from = account_.droppable_from(unsettled, share);
    std::vector<std::vector<Tile>> kept(space_.bounds.size());
    parallel_for(kept.size(), [&](std::size_t object) {
      const std::int64_t end = least_sum(unsettled, object, from[object]);
      for (std::size_t theta = 0; theta < thetas_; ++theta) {
        for_row(object * thetas_ + theta, [&](std::int32_t sum, int x, int y, std::int64_t bins) {
          if (sum < end) {
            const double bound = bound_of(object, sum);
            unsettled.remove(object, bound, bins);
            kept[object].push_back(
                {bound, static_cast<std::int32_t>(object), static_cast<std::int32_t>(theta), x, y});
          }
        });
      }
    });
    return joined(kept);
  }

  static std::vector<Tile> joined(const std::vector<std::vector<Tile>>& lists) {
    std::vector<Tile> all;
    std::size_t count = 0;
    for (const std::vector<Tile>& list : lists) {
      count += list.size();
    }
    all.reserve(count);
    for (const std::vector<Tile>& list : lists) {
      all.insert(all.end(), list.begin(), list.end());
    }
    return all;
  }

  /// The parts, one level down, of tiles that are sorted by place. Leaves out those in which every
  /// element sees the prior.
  /// @param unseen where not null, takes these
  std::vector<Tile> parts_of(std::span<const Tile> tiles, std::size_t level,
                             std::vector<Tile>* unseen = nullptr) {
    std::vector<std::size_t> begins;  // of tasks: tiles of one object and theta
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      if (i == 0 || tiles[i].object != tiles[i - 1].object ||
          tiles[i].theta != tiles[i - 1].theta || i - begins.back() == tiles_per_task) {
        begins.push_back(i);
      }
    }
    std::vector<std::vector<Tile>> parts(begins.size());
    std::vector<std::vector<Tile>> rest(begins.size());
    parallel_for(begins.size(), [&](std::size_t task) {
      thread_local WindowPlaces placed;
      const std::size_t end = task + 1 < begins.size() ? begins[task + 1] : tiles.size();
      const Tile& first = tiles[begins[task]];
      const TileBounds& bounds = space_.bounds[first.object];
      const TileWindow seen =
          seen_window(reaches_[first.theta], space_.maps[first.object], bounds.levels()[level + 1]);
      bounds.place(level + 1, space_.turns[first.theta], elements_, placed);
      parts[task].reserve((end - begins[task]) * batch_tiles);
      for (std::size_t i = begins[task]; i < end; ++i) {
        std::uint32_t sums[batch_tiles] = {};
        const int x = tiles[i].x * batch_side;
        const int y = tiles[i].y * batch_side;
        bounds.add(level + 1, elements_, placed, x, y, sums);
        append_batch(first, level + 1, x, y, sums, parts[task]);
      }
      const auto begin_unseen =
          std::stable_partition(parts[task].begin(), parts[task].end(),
                                [&](const Tile& tile) { return seen.holds(tile); });
      if (unseen != nullptr) {
        rest[task].assign(begin_unseen, parts[task].end());
      }
      parts[task].erase(begin_unseen, parts[task].end());
    });
    if (unseen != nullptr) {
      *unseen = joined(rest);
    }
    std::vector<Tile> all = joined(parts);
    blocks_ += static_cast<std::int64_t>(all.size());
    return all;
  }

  /// Appends the tiles of a batch, at the object and theta of `of`, that hold bins.
  void append_batch(const Tile& of, std::size_t level, int first_x, int first_y,
                    const std::uint32_t* sums, std::vector<Tile>& tiles) const {
    const TileLevel& tiling = space_.bounds[of.object].levels()[level];
    for (int j = 0; j < batch_side; ++j) {
      if (tiling.y.bins(first_y + j) == 0) {
        continue;
      }
      for (int i = 0; i < batch_side; ++i) {
        const Tile tile{
            unpenalised_[of.object][level] - sums[batch_side * i + j] / penalties_per_nat,
            of.object, of.theta, first_x + i, first_y + j};
        if (tiling.x.bins(tile.x) > 0 && may_count(tiling, tile)) {
          tiles.push_back(tile);
        }
      }
    }
  }

  /// Raises the lower bound of the total: follows the best tiles down to their bins.
  /// @param width so many tiles at first
  void raise(std::vector<Tile> tiles, std::size_t level, std::size_t width = beam_tiles) {
    if (!goal_.evidence_nats) {
      leaves_.probe(best_of_beam(std::move(tiles), level, width));
      return;
    }
    // Every label's own total is wanted, too.
    std::vector<std::vector<Tile>> own(space_.bounds.size());
    for (const Tile& tile : tiles) {
      own[space_.label_of[tile.object]].push_back(tile);
    }
    std::vector<Tile> best;
    for (std::vector<Tile>& of_label : own) {
      const std::vector<Tile> found = best_of_beam(std::move(of_label), level, width);
      best.insert(best.end(), found.begin(), found.end());
    }
    leaves_.probe(std::move(best));
  }

  /// Follows tiles down to the smallest ones, the best of each level.
  std::vector<Tile> best_of_beam(std::vector<Tile> tiles, std::size_t level, std::size_t width) {
    for (; level < finest_; ++level) {
      deadline_.cancel_point();
      keep_best(tiles, width);
      std::sort(tiles.begin(), tiles.end(), stands_before);
      tiles = parts_of(tiles, level);
      width = beam_tiles;
    }
    keep_best(tiles, probed_tiles);
    return tiles;
  }

  /// Divides tiles of a level until their bins are evaluated or dropped.
  /// @param tolerance part of the total that may be dropped
  void divide(std::vector<Tile> tiles, std::size_t level, double tolerance) {
    if (level == finest_) {
      leaves_.evaluate(tiles, tolerance);
      return;
    }
    if (tiles.size() > most_together && !deadline_.passed()) {
      // Tiles are divided one lot after another: the total must be known well before the first.
      survey(tiles, level);
      tolerance -= drop(tiles, level, tolerance / static_cast<double>(finest_ - level + 1));
      std::sort(tiles.begin(), tiles.end(), before);
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
      const std::size_t count = deadline_.passed() ? left : std::min(most_together, left);
      const auto first = tiles.begin() + static_cast<std::ptrdiff_t>(begin);
      std::vector<Tile> lot(first, first + static_cast<std::ptrdiff_t>(count));
      if (deadline_.passed()) {
        account_.drop(unsettled(lot, level, space_.bounds, account_));
        return;
      }
      // What tiles do not use up is left for those after them.
      tolerance -= divide_lot(std::move(lot), level,
                              tolerance * static_cast<double>(count) / static_cast<double>(left));
      begin += count;
    }
  }

  /// Divides so many tiles that their parts fit the memory for them.
  /// @returns the part of the total that was dropped
  double divide_lot(std::vector<Tile> tiles, std::size_t level, double tolerance) {
    note(tiles, level);
    std::sort(tiles.begin(), tiles.end(), stands_before);
    std::vector<Tile> unseen;
    std::vector<Tile> parts = parts_of(tiles, level, &unseen);
    for (const Tile& tile : unseen) {
      settle_unseen(space_.bounds[tile.object].levels()[level + 1].box_of(tile));
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

  /// Lowers the bounds of tiles to those of their parts, and follows the best parts down to their
  /// bins.
  void survey(std::vector<Tile>& tiles, std::size_t level) {
    std::sort(tiles.begin(), tiles.end(), stands_before);
    std::vector<Tile> best;
    for (std::size_t begin = 0; begin < tiles.size(); begin += most_together) {
      const auto lot =
          std::span(tiles).subspan(begin, std::min(most_together, tiles.size() - begin));
      deadline_.cancel_point();
      std::vector<Tile> parts = parts_of(lot, level);
      std::size_t next = 0;
      for (Tile& tile : lot) {
        double largest = space_.log_weight[tile.object] + prior_log_likelihoods_[tile.object];
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

  static bool is_part(const Tile& part, const Tile& of) {
    return part.object == of.object && part.theta == of.theta && part.x / batch_side == of.x &&
           part.y / batch_side == of.y;
  }

  /// Drops tiles that hold at most this part of the total together.
  /// @returns the part of the total that was dropped
  double drop(std::vector<Tile>& tiles, std::size_t level, double tolerance) {
    const double dropped = account_.dropped_share();
    UnsettledMass mass = unsettled(tiles, level, space_.bounds, account_);
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

  void note(std::span<const Tile> tiles, std::size_t level) const {
    if (refined_ == nullptr || level == finest_) {
      return;
    }
    for (const Tile& tile : tiles) {
      const BinBox box = space_.bounds[tile.object].levels()[level].box_of(tile);
      refined_->push_back({.object = box.object,
                           .level = static_cast<int>(level),
                           .theta = box.theta,
                           .x_first = box.x_first,
                           .x_count = box.x_count,
                           .y_first = box.y_first,
                           .y_count = box.y_count});
    }
  }

  const BoundSearch& search_;
  const SearchSpace& space_;
  const PoseLattice& lattice_;
  const KnownElements& elements_;
  std::vector<BoundingBox> reaches_;  ///< [theta] of the elements
  std::vector<PoseBlock>* refined_;
  std::size_t thetas_;
  std::size_t finest_;                            ///< level
  std::vector<std::vector<double>> unpenalised_;  ///< [object][level], with the prior weight
  std::vector<double> prior_log_likelihoods_;     ///< [object] of all elements
  std::vector<TileWindow> seen_;                  ///< [object, theta], of the largest tiles
  SearchGoal goal_;
  const Deadline& deadline_;
  MassAccount account_;
  LeafEvaluator evaluator_;
  LeafPass leaves_;
  const BinVisitor& visit_;
  std::int64_t blocks_ = 0;
};

SearchResult BoundSearch::run(const KnownElements& elements, const SearchGoal& goal,
                              const Deadline& deadline, const BinVisitor& visit,
                              std::vector<PoseBlock>* refined) const {
  // Evaluating all in float64 would leave so much rounding; the rest may be used up.
  double least_error = 0.0;
  for (std::size_t i = 0; i < space_.bounds.size(); ++i) {
    least_error = std::max(least_error, likelihood_.float64_error(i, elements));
  }
  SearchGoal reachable = goal;
  reachable.tolerance = std::max(goal.tolerance - 1.1 * least_error, goal.tolerance / 4.0);
  return SearchRun(*this, elements, reachable, deadline, visit, refined).result();
}

}  // namespace palpate
