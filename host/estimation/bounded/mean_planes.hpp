#pragma once

// What mean_search.cpp does with the tiles of a few planes.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "estimation/bounded/mean_search.hpp"
#include "estimation/bounded/penalty_sum.hpp"
#include "estimation/bounded/search/largest_tiles.hpp"
#include "estimation/log_sum.hpp"
#include "estimation/touch_overlap.hpp"

namespace palpate {

/// So much closer are the bounds of the smallest tiles: they may be left out sooner.
inline constexpr double closer_nats = 2.0;

/// The tiles of an axis that hold these bins.
inline std::pair<int, int> tiles_of(const TileAxis& axis, int first_bin, int end_bin) {
  const auto tile_of = [&](int bin) {
    return static_cast<int>(std::ranges::upper_bound(axis.first_bin, bin) -
                            axis.first_bin.begin()) -
           1;
  };
  return {tile_of(first_bin), tile_of(end_bin - 1) + 1};
}

/// Neighbouring planes of one object, and the bins to be evaluated in them.
class MeanSearch::Planes {
 public:
  /// @param object of all planes to come
  Planes(const MeanSearch& of, std::size_t object)
      : of_(of),
        object_(object),
        bounds_(of.space_.bounds[object]),
        levels_(bounds_.levels()),
        places_(levels_.size()),
        placed_at_(levels_.size(), -1) {}

  /// What the largest tiles of a plane tell.
  Survey survey(int theta) {
    enter(theta);
    Survey found{.bins = bins_};
    count_unseen(found);
    if (sum_largest(); !sums_.empty()) {
      const std::uint32_t least = std::ranges::min(sums_);
      PenaltySum all(least);
      for_batches([&](int x, int y, const std::uint32_t* sums) { leave_out(0, x, y, sums, all); });
      found.best = most(0) - least / penalties_per_nat;
      found.left_out = most(0) + all.log();
    }
    return found;
  }

  /// Divides a plane's tiles down to bins, which are evaluated later, but for those whose bounds,
  /// with the prior weight, are below `least`.
  /// @returns log of what these hold at most
  double divide(int theta, double least) {
    enter(theta);
    if (around_.bins() == 0) {
      return nothing;
    }
    sum_largest();
    last_divided_.clear();
    left_out_.clear();
    for (std::size_t level = 0; level < levels_.size(); ++level) {
      const double of_level = level + 1 == levels_.size() ? least + closer_nats : least;
      const double room = std::floor((most(level) - of_level) * penalties_per_nat);
      last_divided_.push_back(
          static_cast<std::int64_t>(std::clamp(room, -1.0, static_cast<double>(largest_sum))));
      left_out_.emplace_back(std::max<std::int64_t>(last_divided_.back(), 0));
    }
    for_batches([&](int x, int y, const std::uint32_t* sums) { take_batch(0, x, y, sums); });
    LogSum left_out;
    for (std::size_t level = 0; level < levels_.size(); ++level) {
      left_out.add(most(level) + left_out_[level].log());
    }
    return left_out.log();
  }

  /// Bounds of the log of the summed likelihood of the bins that count in what was divided, beside
  /// the likelihood's own error.
  LogInterval evaluated(Arithmetic arithmetic) {
    std::int64_t bins = 0;
    for (const BinBox& box : boxes_) {
      bins += box.bins();
    }
    std::vector<double> values(static_cast<std::size_t>(bins));
    of_.likelihood_.evaluate_exact(boxes_, of_.elements_, arithmetic, values);
    const double log_weight = of_.space_.log_weight[object_];
    std::vector<double> logs;
    auto value = values.cbegin();
    Rows row = counted_.cbegin();
    for (const BinBox& box : boxes_) {
      append_counted(box, value, box.x_count, row, logs);
      value += box.bins();
    }
    if (of_.shares_) {
      const LogInterval sum = sum_of_shares(logs);
      return {log_weight + sum.low, log_weight + sum.high};
    }
    LogSum sum;
    for (const double log : logs) {
      sum.add(log);
    }
    return {log_weight + sum.log(), log_weight + sum.log()};
  }

 private:
  /// The log of what a bin counts at most where no element has a penalty.
  double most(std::size_t level) const { return of_.most_[object_][level] + log_most_share_; }

  using Rows = std::vector<OverlapPlane::Bins>::const_iterator;

  /// Appends the values of a box's bins that count.
  /// @param from of its first bin; rows are `pitch` apart
  /// @param row moves on behind the box's rows
  static void append_counted(const BinBox& box, std::vector<double>::const_iterator from,
                             std::ptrdiff_t pitch, Rows& row, std::vector<double>& values) {
    for (int y = 0; y < box.y_count; ++y, ++row) {
      if (row->count > 0) {
        const auto first = from + y * pitch + (row->first - box.x_first);
        values.insert(values.end(), first, first + row->count);
      }
    }
  }

  /// Bounds of the log of the sum of the boxes' likelihoods by their shares.
  /// @param logs log-likelihoods of the bins that count, box after box
  LogInterval sum_of_shares(const std::vector<double>& logs) {
    std::vector<double> counts;  // the bins' shares
    Rows counted = counted_.cbegin();
    double error = 0.0;
    for (std::size_t first = 0, end = 0; first < boxes_.size(); first = end) {
      BinBox around{.object = static_cast<std::int32_t>(object_), .theta = boxes_[first].theta};
      for (; end < boxes_.size() && boxes_[end].theta == around.theta; ++end) {
        around = smallest_around(around, boxes_[end]);
      }
      const OverlapShares::Shares shares = of_.shares_->at(around, share_planes_);
      error = std::max(error, shares.error);
      for (const BinBox& box : std::span(boxes_).subspan(first, end - first)) {
        const auto from = shares.of_bins.begin() +
                          std::ptrdiff_t{box.y_first - around.y_first} * around.x_count +
                          (box.x_first - around.x_first);
        append_counted(box, from, around.x_count, counted, counts);
      }
    }
    if (logs.empty() || std::ranges::max(logs) == nothing) {
      return {nothing, nothing};
    }
    const double largest = std::ranges::max(logs);
    double sum = 0.0;
    double all = 0.0;
    for (std::size_t i = 0; i < logs.size(); ++i) {
      const double likelihood = std::exp(logs[i] - largest);
      sum += counts[i] * likelihood;
      all += likelihood;
    }
    // Each term of the sums rounds by a unit.
    const double relative =
        of_.shares_->relative_error() + 4.0 * static_cast<double>(logs.size()) * 0x1p-53;
    return {largest + std::log(std::max(sum - error * all, 0.0)) - relative,
            largest + std::log(sum + error * all) + relative};
  }

  /// Sets how many of the plane's bins, or what shares of them, lie outside the largest tiles.
  void count_unseen(Survey& of) {
    if (all_seen_) {
      return;
    }
    const BinBox seen = largest_.x_first < largest_.x_end ? box_of(0, largest_) : BinBox{};
    if (!of_.shares_) {
      std::int64_t seen_bins = 0;
      for (int y = seen.y_first; y < seen.y_first + seen.y_count; ++y) {
        seen_bins += in_row(seen, y).count;
      }
      of.unseen = static_cast<double>(bins_ - seen_bins);
      return;
    }
    const OverlapShares::Shares shares = of_.shares_->at(around_, share_planes_);
    const double* share = shares.of_bins.data();
    for (int y = around_.y_first; y < around_.y_first + around_.y_count; ++y) {
      const bool row_seen = y >= seen.y_first && y < seen.y_first + seen.y_count;
      for (int x = around_.x_first; x < around_.x_first + around_.x_count; ++x, ++share) {
        if (!row_seen || x < seen.x_first || x >= seen.x_first + seen.x_count) {
          of.unseen += *share;
          of.unseen_error += shares.error;
        }
      }
    }
    of.unseen_error += of.unseen * (std::expm1(of_.shares_->relative_error()) +
                                    2.0 * static_cast<double>(around_.bins()) * 0x1p-53);
  }

  /// Finds the plane's bins that count, and the largest tiles that hold them and see the map.
  void enter(int theta) {
    theta_ = theta;
    if (of_.shares_) {
      enter_shares();
    } else {
      enter_overlap();
    }
    largest_ = {};
    all_seen_ = around_.bins() == 0;
    if (all_seen_) {
      return;
    }
    const int x_end = around_.x_first + around_.x_count;
    const int y_end = around_.y_first + around_.y_count;
    const TileLevel& level = levels_.front();
    const auto [x_tile, x_tile_end] = tiles_of(level.x, around_.x_first, x_end);
    const auto [y_tile, y_tile_end] = tiles_of(level.y, around_.y_first, y_end);
    const TileRange seen =
        seen_tiles(of_.reaches_[static_cast<std::size_t>(theta)], of_.space_.maps[object_], level);
    const auto down = [](int tile) { return tile - tile % batch_side; };
    const TileRange batches{down(std::max(x_tile, seen.x_first)),
                            down(std::min(x_tile_end, seen.x_end) + batch_side - 1),
                            down(std::max(y_tile, seen.y_first)),
                            down(std::min(y_tile_end, seen.y_end) + batch_side - 1)};
    if (batches.x_first < batches.x_end && batches.y_first < batches.y_end) {
      largest_ = batches;
      const BinBox box = box_of(0, batches);
      all_seen_ = box.x_first <= around_.x_first && box.y_first <= around_.y_first &&
                  box.x_first + box.x_count >= x_end && box.y_first + box.y_count >= y_end;
    }
  }

  /// Finds the bins at which the array overlaps the object.
  void enter_overlap() {
    const PoseLattice& lattice = of_.options_.lattice;
    const OverlapPlane overlap(of_.rectangle_, of_.space_.boxes[object_], lattice, theta_);
    bins_ = 0;
    around_ = {};
    rows_.clear();
    for (int y = 0; y < lattice.y_mm.count; ++y) {
      const OverlapPlane::Bins row =
          of_.everywhere_ ? OverlapPlane::Bins{0, lattice.x_mm.count} : overlap.row(y);
      rows_.push_back(row);
      if (row.count > 0) {
        bins_ += row.count;
        around_ = smallest_around(
            around_, {.y_first = y, .y_count = 1, .x_first = row.first, .x_count = row.count});
      }
    }
  }
  /// Finds the bins that have a share, or a box around them.
  void enter_shares() {
    bins_ = of_.shares_->overlapping(object_, theta_);
    around_ = of_.shares_->reach(object_, theta_);
    log_most_share_ = std::log(of_.shares_->most(object_, theta_));
    rows_.assign(static_cast<std::size_t>(of_.options_.lattice.y_mm.count), {});
    std::fill_n(rows_.begin() + around_.y_first, around_.y_count,
                OverlapPlane::Bins{around_.x_first, around_.x_count});
  }

  BinBox box_of(std::size_t level, const TileRange& tiles) const {
    return levels_[level].box_of(static_cast<std::int32_t>(object_), theta_, tiles);
  }
  /// The bins of a box's row that count.
  OverlapPlane::Bins in_row(const BinBox& box, int y) const {
    const OverlapPlane::Bins& row = rows_[static_cast<std::size_t>(y)];
    const int first = std::max(box.x_first, row.first);
    return {first, std::max(0, std::min(box.x_first + box.x_count, row.first + row.count) - first)};
  }
  bool counts(const BinBox& box) const {
    for (int y = box.y_first; y < box.y_first + box.y_count; ++y) {
      if (in_row(box, y).count > 0) {
        return true;
      }
    }
    return false;
  }

  const WindowPlaces& places(std::size_t level) {
    if (placed_at_[level] != theta_) {
      bounds_.place(level, of_.space_.turns[static_cast<std::size_t>(theta_)], of_.elements_,
                    places_[level]);
      placed_at_[level] = theta_;
    }
    return places_[level];
  }

  /// Sums the penalties of the largest tiles.
  void sum_largest() {
    const int batches = (largest_.x_end - largest_.x_first) / batch_side;
    const int rows = (largest_.y_end - largest_.y_first) / batch_side;
    sums_.assign(static_cast<std::size_t>(batches) * static_cast<std::size_t>(rows) * batch_tiles,
                 0);
    std::uint32_t* sums = sums_.data();
    for (int y = largest_.y_first; y < largest_.y_end; y += batch_side) {
      for (int x = largest_.x_first; x < largest_.x_end; x += batch_side, sums += batch_tiles) {
        bounds_.add(0, of_.elements_, places(0), x, y, sums);
      }
    }
  }
  /// Calls visit(x, y, sums) for the batches of the largest tiles.
  template <typename Visit>
  void for_batches(const Visit& visit) const {
    const std::uint32_t* sums = sums_.data();
    for (int y = largest_.y_first; y < largest_.y_end; y += batch_side) {
      for (int x = largest_.x_first; x < largest_.x_end; x += batch_side, sums += batch_tiles) {
        visit(x, y, sums);
      }
    }
  }

  /// Leaves out the tiles of a batch.
  /// @param but those that are not
  void leave_out(std::size_t level, int x, int y, const std::uint32_t* sums, PenaltySum& to,
                 const TileRange& but = {}) const {
    const TileLevel& tiles = levels_[level];
    for (int i = 0; i < batch_side; ++i) {
      const std::int64_t columns = tiles.x.bins(x + i);
      for (int j = 0; j < batch_side; ++j, ++sums) {
        if (!but.holds({.x = x + i, .y = y + j})) {
          to.add(*sums, columns * tiles.y.bins(y + j));
        }
      }
    }
  }

  /// Leaves out the tiles of a batch whose bounds are low, and divides the others.
  void take_batch(std::size_t level, int x, int y, const std::uint32_t* sums) {
    const std::int64_t last_divided = last_divided_[level];
    if (*std::min_element(sums, sums + batch_tiles) > last_divided) {
      leave_out(level, x, y, sums, left_out_[level]);
      return;
    }
    const bool finest = level + 1 == levels_.size();
    TileRange needed{x + batch_side, x, y + batch_side, y};
    for (int i = 0; i < batch_side; ++i) {
      for (int j = 0; j < batch_side; ++j) {
        const std::uint32_t sum = sums[batch_side * i + j];
        const TileRange tile{x + i, x + i + 1, y + j, y + j + 1};
        const BinBox box = box_of(level, tile);
        if (sum > last_divided) {
          if (!finest) {
            left_out_[level].add(sum, box.bins());
          }
        } else if (!counts(box)) {
          continue;
        } else if (finest) {
          needed = {std::min(needed.x_first, tile.x_first), std::max(needed.x_end, tile.x_end),
                    std::min(needed.y_first, tile.y_first), std::max(needed.y_end, tile.y_end)};
        } else {
          std::uint32_t parts[batch_tiles] = {};
          const int first_x = tile.x_first * batch_side;
          const int first_y = tile.y_first * batch_side;
          bounds_.add(level + 1, of_.elements_, places(level + 1), first_x, first_y, parts);
          take_batch(level + 1, first_x, first_y, parts);
        }
      }
    }
    if (finest) {
      leave_out(level, x, y, sums, left_out_[level], needed);
    }
    if (needed.x_first < needed.x_end) {
      // The smallest tiles of a batch are evaluated as one box, with those between them.
      const BinBox box = boxes_.emplace_back(box_of(level, needed));
      for (int row = box.y_first; row < box.y_first + box.y_count; ++row) {
        counted_.push_back(in_row(box, row));
      }
    }
  }

  const MeanSearch& of_;
  std::size_t object_;
  const TileBounds& bounds_;
  std::span<const TileLevel> levels_;
  std::vector<WindowPlaces> places_;         ///< [level] of the elements
  std::vector<int> placed_at_;               ///< [level] theta
  std::vector<BinBox> boxes_;                ///< to be evaluated
  std::vector<OverlapPlane::Bins> counted_;  ///< [box, row]
  OverlapShares::Planes share_planes_;

  // What is known of the plane.
  int theta_ = 0;
  std::vector<OverlapPlane::Bins> rows_;  ///< [y] bins that count, or may have a share
  BinBox around_;                         ///< these
  std::int64_t bins_ = 0;                 ///< that count in the mean
  double log_most_share_ = 0.0;           ///< of any of the plane's bins
  TileRange largest_;      ///< whole batches of the largest tiles, about those that hold seen bins
  bool all_seen_ = false;  ///< they hold all bins that count
  std::vector<std::uint32_t> sums_;         ///< [batch, tile] of these
  std::vector<std::int64_t> last_divided_;  ///< [level] the largest sum of a tile that is divided
  std::vector<PenaltySum> left_out_;        ///< [level]
};

}  // namespace palpate
