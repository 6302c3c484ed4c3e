#include "estimation/bounded/mean_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "estimation/bounded/search/item_bounds.hpp"
#include "estimation/log_sum.hpp"
#include "estimation/parallel_for.hpp"

namespace palpate {

namespace {

/// So much closer are the bounds of the smallest tiles: they may be left out sooner.
constexpr double closer_nats = 2.0;

/// The tiles of an axis that hold these bins.
std::pair<int, int> tiles_of(const TileAxis& axis, int first_bin, int end_bin) {
  const auto tile_of = [&](int bin) {
    return static_cast<int>(std::ranges::upper_bound(axis.first_bin, bin) -
                            axis.first_bin.begin()) -
           1;
  };
  return {tile_of(first_bin), tile_of(end_bin - 1) + 1};
}

/// A batch of tiles: its first one, and the sums of all tiles' penalties.
struct Batch {
  int x;
  int y;
  std::array<std::uint32_t, batch_tiles> sums{};

  /// Calls visit(tile, sum) for its tiles, [x, y].
  template <typename Visit>
  void for_tiles(const Visit& visit) const {
    auto sum = sums.begin();
    for (int i = x; i < x + batch_side; ++i) {
      for (int j = y; j < y + batch_side; ++j) {
        visit(TileRange{i, i + 1, j, j + 1}, *sum++);
      }
    }
  }
};

/// The sum of e^-penalty over the bins of many tiles, whose penalties are no less than a least one:
/// each rounded up to whole sixteenths of a nat, and what lies 64 nats below the least to e^-64 of
/// it.
class PenaltySum {
 public:
  explicit PenaltySum(std::int64_t least) : least_(least) {}

  void add(std::int64_t penalty, std::int64_t bins) {
    const auto slot =
        static_cast<std::size_t>(std::max<std::int64_t>(penalty - least_, 0) / per_slot);
    sum_ += static_cast<double>(bins) * shares()[std::min(slot, slots - 1)];
  }
  /// Log of the sum, in nats.
  double log() const { return std::log(sum_) - static_cast<double>(least_) / penalties_per_nat; }

 private:
  static constexpr std::int64_t per_slot = 16;
  static constexpr std::size_t slots = 1025;

  static const std::array<double, slots>& shares() {
    static const auto all = [] {
      std::array<double, slots> of{};
      for (std::size_t i = 0; i < slots; ++i) {
        of[i] = std::exp(-static_cast<double>(per_slot * i) / penalties_per_nat);
      }
      return of;
    }();
    return all;
  }

  std::int64_t least_;
  double sum_ = 0.0;
};

/// A plane's bins that count in the mean, and the largest tiles that are looked at.
struct Plane {
  int theta = 0;
  std::vector<RowBins> rows;  ///< [y] bins that count
  std::int64_t bins = 0;      ///< number of bins that count
  TileRange largest;          ///< whole batches about those that see the map and hold such bins

  /// The bins of a box's row that count.
  RowBins in_row(const BinBox& box, int y) const {
    const RowBins& row = rows[static_cast<std::size_t>(y)];
    const int first = std::max(box.x_first, row.first);
    return {first, std::max(0, std::min(box.x_first + box.x_count, row.first + row.count) - first)};
  }
  /// The number of bins of the box that count.
  std::int64_t count_in(const BinBox& box) const {
    std::int64_t count = 0;
    for (int y = box.y_first; y < box.y_first + box.y_count; ++y) {
      count += in_row(box, y).count;
    }
    return count;
  }
};

}  // namespace

/// Divides the tiles of planes of one object level by level, one plane after another, and evaluates
/// the bins of the smallest tiles of all of them together.
class MeanSearch::Division {
 public:
  Division(const MeanSearch& mean, std::size_t object)
      : mean_(mean),
        object_(object),
        bounds_(mean.space_.bounds[object]),
        levels_(bounds_.levels()),
        unpenalised_(mean.unpenalised_[object]) {}

  /// Looks at the largest tiles of a plane.
  Survey survey(int theta) {
    const Plane plane = this->plane(theta);
    Survey found{.bins = plane.bins,
                 .off_map = plane.bins - plane.count_in(box_of(0, plane, plane.largest))};
    const std::vector<Batch> batches = largest_batches(plane);
    if (batches.empty()) {
      return found;
    }
    std::uint32_t least = largest_sum;
    for (const Batch& batch : batches) {
      least = std::min(least, std::ranges::min(batch.sums));
    }
    PenaltySum all(least);
    for (const Batch& batch : batches) {
      batch.for_tiles([&](const TileRange& tile, std::uint32_t sum) {
        all.add(sum, box_of(0, plane, tile).bins());
      });
    }
    found.best = unpenalised_.front() - least / penalties_per_nat;
    found.left_out = unpenalised_.front() + all.log();
    return found;
  }

  /// Divides a plane's tiles down to bins, which are evaluated later, but for those whose bounds,
  /// with the prior weight, are below `least`.
  /// @returns log of what these hold at most
  double divide(int theta, double least) {
    const Plane plane = this->plane(theta);
    LogSum left_out;
    std::vector<Batch> batches = largest_batches(plane);
    for (std::size_t level = 0; level < levels_.size() && !batches.empty(); ++level) {
      const bool finest = level + 1 == levels_.size();
      const double of_level = finest ? least + closer_nats : least;
      const double room = std::floor((unpenalised_[level] - of_level) * penalties_per_nat);
      const auto last_divided =
          static_cast<std::int64_t>(std::clamp(room, -1.0, static_cast<double>(largest_sum)));
      PenaltySum of_tiles(std::max<std::int64_t>(last_divided, 0));
      if (finest) {
        for (const Batch& batch : batches) {
          take_smallest(plane, batch, last_divided, of_tiles);
        }
      } else {
        batches = parts_of(plane, level, batches, last_divided, of_tiles);
      }
      left_out.add(unpenalised_[level] + of_tiles.log());
    }
    return left_out.log();
  }

  /// The log of the summed likelihood of the bins that count in what was divided, with the prior
  /// weight.
  double evaluated() const {
    std::vector<double> values(bins_in(boxes_));
    mean_.likelihood_.evaluate_undisplaced(boxes_, mean_.elements_, values);
    LogSum sum;
    auto value = values.cbegin();
    auto row = boxes_rows_.cbegin();
    for (const BinBox& box : boxes_) {
      for (int y = 0; y < box.y_count; ++y, ++row, value += box.x_count) {
        for (int x = 0; x < row->count; ++x) {
          sum.add(value[row->first - box.x_first + x]);
        }
      }
    }
    return mean_.space_.log_weight[object_] + sum.log();
  }

 private:
  Plane plane(int theta) const {
    const PoseLattice& lattice = mean_.options_.lattice;
    Plane plane{.theta = theta,
                .rows = std::vector<RowBins>(static_cast<std::size_t>(lattice.y_mm.count),
                                             {0, lattice.x_mm.count})};
    if (!mean_.everywhere_) {
      find_overlap(mean_.rectangle_, mean_.space_.boxes[object_], lattice, theta, plane.rows);
    }
    BinBox around;
    plane.bins = count_bins(plane.rows, around);
    const TileLevel& level = levels_.front();
    const auto [x_tile, x_end] = tiles_of(level.x, around.x_first, around.x_first + around.x_count);
    const auto [y_tile, y_end] = tiles_of(level.y, around.y_first, around.y_first + around.y_count);
    const TileRange seen = seen_tiles(mean_.reaches_[static_cast<std::size_t>(theta)],
                                      mean_.space_.maps[object_], level);
    const auto down = [](int tile) { return tile - tile % batch_side; };
    plane.largest = {
        down(std::max(x_tile, seen.x_first)), down(std::min(x_end, seen.x_end) + batch_side - 1),
        down(std::max(y_tile, seen.y_first)), down(std::min(y_end, seen.y_end) + batch_side - 1)};
    return plane;
  }

  BinBox box_of(std::size_t level, const Plane& plane, const TileRange& tiles) const {
    return levels_[level].box_of(static_cast<std::int32_t>(object_), plane.theta, tiles);
  }
  /// Places the elements for a plane's batches of a level.
  void place(std::size_t level, const Plane& plane) {
    bounds_.place(level, mean_.space_.turns[static_cast<std::size_t>(plane.theta)], mean_.elements_,
                  placed_);
  }
  /// @param x, y the first tile, of the level for which elements are placed
  Batch batch(std::size_t level, int x, int y) const {
    Batch batch{x, y};
    bounds_.add(level, mean_.elements_, placed_, x, y, batch.sums.data());
    return batch;
  }
  std::vector<Batch> largest_batches(const Plane& plane) {
    std::vector<Batch> batches;
    const TileRange& tiles = plane.largest;
    if (tiles.x_first >= tiles.x_end || tiles.y_first >= tiles.y_end) {
      return batches;
    }
    place(0, plane);
    for (int y = tiles.y_first; y < tiles.y_end; y += batch_side) {
      for (int x = tiles.x_first; x < tiles.x_end; x += batch_side) {
        batches.push_back(batch(0, x, y));
      }
    }
    return batches;
  }
  /// The parts of a level's tiles. Leaves out tiles whose sums are larger than `last_divided`.
  std::vector<Batch> parts_of(const Plane& plane, std::size_t level, std::span<const Batch> batches,
                              std::int64_t last_divided, PenaltySum& left_out) {
    std::vector<Batch> parts;
    place(level + 1, plane);
    for (const Batch& tiles : batches) {
      tiles.for_tiles([&](const TileRange& tile, std::uint32_t sum) {
        const BinBox box = box_of(level, plane, tile);
        if (sum > last_divided) {
          left_out.add(sum, box.bins());
        } else if (plane.count_in(box) > 0) {
          parts.push_back(batch(level + 1, batch_side * tile.x_first, batch_side * tile.y_first));
        }
      });
    }
    return parts;
  }
  /// Leaves out the smallest tiles of a batch whose sums are larger than `last_divided`. The others
  /// are to be evaluated as one box, with those between them.
  void take_smallest(const Plane& plane, const Batch& batch, std::int64_t last_divided,
                     PenaltySum& left_out) {
    const std::size_t finest = levels_.size() - 1;
    TileRange needed{batch.x + batch_side, batch.x, batch.y + batch_side, batch.y};
    batch.for_tiles([&](const TileRange& tile, std::uint32_t sum) {
      if (sum <= last_divided && plane.count_in(box_of(finest, plane, tile)) > 0) {
        needed = {std::min(needed.x_first, tile.x_first), std::max(needed.x_end, tile.x_end),
                  std::min(needed.y_first, tile.y_first), std::max(needed.y_end, tile.y_end)};
      }
    });
    batch.for_tiles([&](const TileRange& tile, std::uint32_t sum) {
      if (!needed.holds({.x = tile.x_first, .y = tile.y_first})) {
        left_out.add(sum, box_of(finest, plane, tile).bins());
      }
    });
    if (needed.x_first < needed.x_end) {
      const BinBox& box = boxes_.emplace_back(box_of(finest, plane, needed));
      for (int y = box.y_first; y < box.y_first + box.y_count; ++y) {
        boxes_rows_.push_back(plane.in_row(box, y));
      }
    }
  }

  const MeanSearch& mean_;
  std::size_t object_;
  const TileBounds& bounds_;
  std::span<const TileLevel> levels_;
  std::span<const double> unpenalised_;  ///< [level]
  WindowPlaces placed_;                  ///< see place()
  std::vector<BinBox> boxes_;            ///< to be evaluated
  std::vector<RowBins> boxes_rows_;      ///< [box, row] bins that count
};

MeanSearch::MeanSearch(const SearchSpace& space, const BoundedOptions& options,
                       const BinLikelihood& likelihood, const TouchEvidence& touch,
                       KnownElements known)
    : space_(space),
      options_(options),
      likelihood_(likelihood),
      elements_(std::move(known)),
      rectangle_(
          array_rectangle(touch.T_robot_sensor, touch.elements_mm, options.lattice.pivot_mm)),
      reaches_(undisplaced_reaches(elements_, space.turns)),
      unpenalised_(unpenalised(space, elements_)),
      prior_log_likelihood_(
          prior_log_likelihoods(elements_, options.contact, space.bounds.size())) {
  for (std::size_t i = 0; i < space.bounds.size(); ++i) {
    prior_log_likelihood_[i] += space.log_weight[i];
    errors_.push_back(likelihood.undisplaced_error(i, elements_));
  }
}

template <typename Work>
bool MeanSearch::for_planes(const Deadline& deadline, const Work& work) const {
  constexpr std::size_t together = 8;
  constexpr std::size_t tasks_between_deadlines = 1024;
  const std::size_t thetas = space_.turns.size();
  const std::size_t of_object = (thetas + together - 1) / together;
  const std::size_t tasks = of_object * space_.bounds.size();
  for (std::size_t begin = 0; begin < tasks; begin += tasks_between_deadlines) {
    if (deadline.passed()) {
      return false;
    }
    parallel_for(std::min(tasks_between_deadlines, tasks - begin), [&](std::size_t i) {
      const std::size_t object = (begin + i) / of_object;
      const std::size_t first = (begin + i) % of_object * together;
      Division division(*this, object);
      work(division, object * thetas + first, object * thetas + std::min(first + together, thetas));
    });
  }
  return true;
}

bool MeanSearch::survey(const Deadline& deadline) {
  const std::size_t thetas = space_.turns.size();
  std::vector<Survey> surveys(space_.bounds.size() * thetas);
  if (!for_planes(deadline, [&](Division& division, std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i) {
          surveys[i] = division.survey(static_cast<int>(i % thetas));
        }
      })) {
    return false;
  }
  std::int64_t bins = 0;
  double weighted = 0.0;
  for (std::size_t i = 0; i < surveys.size(); ++i) {
    bins += surveys[i].bins;
    weighted += std::exp(space_.log_weight[i / thetas]) * static_cast<double>(surveys[i].bins);
  }
  if (bins == 0 && !everywhere_) {
    // Where no pose of the region brings the array to an object, all poses are alike.
    everywhere_ = true;
    return survey(deadline);
  }
  surveys_ = std::move(surveys);
  log_bins_ = std::log(static_cast<double>(bins));
  log_weighted_bins_ = std::log(weighted);
  log_share_ = log_weighted_bins_ - std::log(static_cast<double>(options_.lattice.bins()));
  return true;
}

std::optional<LogInterval> MeanSearch::bounds(double least, const Deadline& deadline) {
  if (surveys_.empty() && !survey(deadline)) {
    return {};
  }
  // The mean is of so many bins, each with its object's weight.
  const double least_of_bin = least + log_weighted_bins_ - log_bins_;
  const std::size_t thetas = space_.turns.size();
  std::vector<double> left_out(surveys_.size());
  std::vector<double> evaluated(surveys_.size(), nothing);
  if (!for_planes(deadline, [&](Division& division, std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i) {
          left_out[i] = surveys_[i].best < least_of_bin
                            ? surveys_[i].left_out
                            : division.divide(static_cast<int>(i % thetas), least_of_bin);
        }
        evaluated[first] = division.evaluated();
      })) {
    return {};
  }
  LogSum low;
  LogSum high;
  for (std::size_t i = 0; i < surveys_.size(); ++i) {
    const std::size_t object = i / thetas;
    const double error = errors_[object];
    low.add(evaluated[i] - error);
    high.add(evaluated[i] + error);
    high.add(left_out[i]);
    if (surveys_[i].off_map > 0) {
      // Where every element sees the prior, all bins have the same likelihood.
      const double off_map =
          prior_log_likelihood_[object] + std::log(static_cast<double>(surveys_[i].off_map));
      low.add(off_map - error);
      high.add(off_map + error);
    }
  }
  const double log_low = low.log() - log_weighted_bins_;
  const double log_high = high.log() - log_weighted_bins_;
  // Each exponential and each addition of the sums rounds by a few units of 2^-53, as logs do.
  const double terms = std::exp(log_bins_) + static_cast<double>(surveys_.size());
  const double rounding = 4.0 * (terms + std::abs(log_high)) * 0x1p-53;
  return LogInterval{log_low - rounding, log_high + rounding};
}

}  // namespace palpate
