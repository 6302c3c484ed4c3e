#include "estimation/bounded/plane_division.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "estimation/bounded/search/item_bounds.hpp"
#include "estimation/log_sum.hpp"

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

/// Calls visit(x, y, sums) for whole batches of tiles: their first tiles, and their sums.
template <typename Sum, typename Visit>
void for_batches(const TileRange& tiles, Sum* sums, const Visit& visit) {
  for (int y = tiles.y_first; y < tiles.y_end; y += batch_side) {
    for (int x = tiles.x_first; x < tiles.x_end; x += batch_side, sums += batch_tiles) {
      visit(x, y, sums);
    }
  }
}

}  // namespace

/// The sum of e^-penalty over the bins of many tiles, whose penalties are no less than a least one:
/// each rounded up to whole sixteenths of a nat, and what lies 64 nats below the least to e^-64 of
/// it.
class PlaneDivision::PenaltySum {
 public:
  explicit PenaltySum(std::int64_t least) : least_(least) {}

  void add(std::int64_t penalty, std::int64_t bins) {
    const auto slot =
        static_cast<std::size_t>(std::max<std::int64_t>(penalty - least_, 0) / per_slot);
    sum_ += static_cast<double>(bins) * shares()[std::min(slot, slots - 1)];
  }
  /// Adds the tiles of a batch.
  /// @param but those that are not
  void add_batch(const TileLevel& tiles, int x, int y, const std::uint32_t* penalties,
                 const TileRange& but = {}) {
    for (int i = 0; i < batch_side; ++i) {
      const std::int64_t columns = tiles.x.bins(x + i);
      for (int j = 0; j < batch_side; ++j, ++penalties) {
        if (!but.holds({.x = x + i, .y = y + j})) {
          add(*penalties, columns * tiles.y.bins(y + j));
        }
      }
    }
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

RowBins PlaneDivision::Plane::in_row(const BinBox& box, int y) const {
  const RowBins& row = rows[static_cast<std::size_t>(y)];
  const int first = std::max(box.x_first, row.first);
  return {first, std::max(0, std::min(box.x_first + box.x_count, row.first + row.count) - first)};
}

std::int64_t PlaneDivision::Plane::count_in(const BinBox& box) const {
  std::int64_t count = 0;
  for (int y = box.y_first; y < box.y_first + box.y_count; ++y) {
    count += in_row(box, y).count;
  }
  return count;
}

PlaneDivision::PlaneDivision(const MeanTask& task, std::size_t object)
    : task_(task),
      object_(object),
      bounds_(task.space.bounds[object]),
      levels_(bounds_.levels()),
      unpenalised_(task.unpenalised[object]),
      placed_(levels_.size()) {}

PlaneSurvey PlaneDivision::survey(int theta, LargestSums& sums) {
  const Plane plane = this->plane(theta);
  PlaneSurvey found{.bins = plane.bins};
  if (!plane.all_seen) {
    found.off_map = plane.bins - plane.count_in(box_of(0, plane, plane.largest));
  }
  sums = largest_sums(plane);
  if (!sums.empty()) {
    const std::uint32_t least = std::ranges::min(sums);
    PenaltySum all(least);
    for_batches(plane.largest, sums.data(), [&](int x, int y, const std::uint32_t* of_batch) {
      all.add_batch(levels_.front(), x, y, of_batch);
    });
    found.best = unpenalised_.front() - least / penalties_per_nat;
    found.left_out = unpenalised_.front() + all.log();
  }
  return found;
}

double PlaneDivision::divide(int theta, double least, const LargestSums& kept) {
  const Plane plane = this->plane(theta);
  if (plane.bins == 0) {
    return PlaneSurvey::nothing;
  }
  Division division{.plane = plane};
  for (std::size_t level = 0; level < levels_.size(); ++level) {
    const double of_level = level + 1 == levels_.size() ? least + closer_nats : least;
    const double room = std::floor((unpenalised_[level] - of_level) * penalties_per_nat);
    division.last_divided.push_back(
        static_cast<std::int64_t>(std::clamp(room, -1.0, static_cast<double>(largest_sum))));
    division.left_out.emplace_back(std::max<std::int64_t>(division.last_divided.back(), 0));
  }
  const LargestSums again = kept.empty() ? largest_sums(plane) : LargestSums();
  const LargestSums& sums = kept.empty() ? again : kept;
  for_batches(plane.largest, sums.data(), [&](int x, int y, const std::uint32_t* of_batch) {
    divide_batch(division, 0, x, y, of_batch);
  });
  LogSum left_out;
  for (std::size_t level = 0; level < levels_.size(); ++level) {
    left_out.add(unpenalised_[level] + division.left_out[level].log());
  }
  return left_out.log();
}

double PlaneDivision::evaluated() const {
  std::vector<double> values(bins_in(boxes_));
  task_.likelihood.evaluate_undisplaced(boxes_, task_.elements, values);
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
  return task_.space.log_weight[object_] + sum.log();
}

PlaneDivision::Plane PlaneDivision::plane(int theta) const {
  Plane plane{.theta = theta};
  plane.rows.resize(static_cast<std::size_t>(task_.lattice.y_mm.count));
  if (task_.everywhere) {
    std::ranges::fill(plane.rows, RowBins{0, task_.lattice.x_mm.count});
  } else {
    find_overlap(task_.array, task_.space.boxes[object_], task_.lattice, theta, plane.rows);
  }
  BinBox& around = plane.around;
  plane.bins = count_bins(plane.rows, around);
  if (plane.bins == 0) {
    return plane;
  }
  const int x_end = around.x_first + around.x_count;
  const int y_end = around.y_first + around.y_count;
  const TileLevel& level = levels_.front();
  const auto [x_tile, x_tile_end] = tiles_of(level.x, around.x_first, x_end);
  const auto [y_tile, y_tile_end] = tiles_of(level.y, around.y_first, y_end);
  const TileRange seen =
      seen_tiles(task_.reaches[static_cast<std::size_t>(theta)], task_.space.maps[object_], level);
  const auto down = [](int tile) { return tile - tile % batch_side; };
  const TileRange batches{down(std::max(x_tile, seen.x_first)),
                          down(std::min(x_tile_end, seen.x_end) + batch_side - 1),
                          down(std::max(y_tile, seen.y_first)),
                          down(std::min(y_tile_end, seen.y_end) + batch_side - 1)};
  plane.all_seen = false;
  if (batches.x_first < batches.x_end && batches.y_first < batches.y_end) {
    plane.largest = batches;
    const BinBox box = box_of(0, plane, batches);
    plane.all_seen = box.x_first <= around.x_first && box.y_first <= around.y_first &&
                     box.x_first + box.x_count >= x_end && box.y_first + box.y_count >= y_end;
  }
  return plane;
}

const WindowPlaces& PlaneDivision::places(std::size_t level, int theta) {
  Placed& placed = placed_[level];
  if (placed.theta != theta) {
    bounds_.place(level, task_.space.turns[static_cast<std::size_t>(theta)], task_.elements,
                  placed.places);
    placed.theta = theta;
  }
  return placed.places;
}

PlaneDivision::LargestSums PlaneDivision::largest_sums(const Plane& plane) {
  const TileRange& tiles = plane.largest;
  LargestSums sums(static_cast<std::size_t>(tiles.x_end - tiles.x_first) *
                   static_cast<std::size_t>(tiles.y_end - tiles.y_first));
  for_batches(tiles, sums.data(), [&](int x, int y, std::uint32_t* of_batch) {
    bounds_.add(0, task_.elements, places(0, plane.theta), x, y, of_batch);
  });
  return sums;
}

void PlaneDivision::divide_batch(Division& division, std::size_t level, int x, int y,
                                 const std::uint32_t* sums) {
  const std::int64_t last_divided = division.last_divided[level];
  if (*std::min_element(sums, sums + batch_tiles) > last_divided) {
    division.left_out[level].add_batch(levels_[level], x, y, sums);
    return;
  }
  if (level + 1 == levels_.size()) {
    take_smallest(division, x, y, sums);
    return;
  }
  const Plane& plane = division.plane;
  for (int i = 0; i < batch_side; ++i) {
    for (int j = 0; j < batch_side; ++j) {
      const std::uint32_t sum = sums[batch_side * i + j];
      const BinBox box = box_of(level, plane, {x + i, x + i + 1, y + j, y + j + 1});
      if (sum > last_divided) {
        division.left_out[level].add(sum, box.bins());
      } else if (plane.count_in(box) > 0) {
        std::uint32_t parts[batch_tiles] = {};
        const int first_x = (x + i) * batch_side;
        const int first_y = (y + j) * batch_side;
        bounds_.add(level + 1, task_.elements, places(level + 1, plane.theta), first_x, first_y,
                    parts);
        divide_batch(division, level + 1, first_x, first_y, parts);
      }
    }
  }
}

void PlaneDivision::take_smallest(Division& division, int x, int y, const std::uint32_t* sums) {
  const std::size_t finest = levels_.size() - 1;
  const Plane& plane = division.plane;
  TileRange needed{x + batch_side, x, y + batch_side, y};
  for (int i = 0; i < batch_side; ++i) {
    for (int j = 0; j < batch_side; ++j) {
      const TileRange tile{x + i, x + i + 1, y + j, y + j + 1};
      if (sums[batch_side * i + j] <= division.last_divided[finest] &&
          plane.count_in(box_of(finest, plane, tile)) > 0) {
        needed = {std::min(needed.x_first, tile.x_first), std::max(needed.x_end, tile.x_end),
                  std::min(needed.y_first, tile.y_first), std::max(needed.y_end, tile.y_end)};
      }
    }
  }
  division.left_out[finest].add_batch(levels_[finest], x, y, sums, needed);
  if (needed.x_first < needed.x_end) {
    // The smallest tiles of a batch are evaluated as one box, with those between them.
    const BinBox& box = boxes_.emplace_back(box_of(finest, plane, needed));
    for (int y_bin = box.y_first; y_bin < box.y_first + box.y_count; ++y_bin) {
      boxes_rows_.push_back(plane.in_row(box, y_bin));
    }
  }
}

}  // namespace palpate
