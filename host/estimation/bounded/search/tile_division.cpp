#include "estimation/bounded/search/tile_division.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include "estimation/bounded/parallel_for.hpp"

namespace palpate {

namespace {

/// Tiles of one theta that a task divides.
constexpr std::size_t tiles_per_task = 64;

std::vector<Tile> joined(const std::vector<std::vector<Tile>>& lists) {
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

}  // namespace

TileDivision::TileDivision(const SearchTask& task, const LargestTiles& largest)
    : space_(task.space),
      largest_(largest),
      elements_(task.elements),
      counted_(task.goal.counted),
      thetas_(space_.turns.size()),
      reaches_(reaches_of(elements_, space_.turns)),
      seen_(space_.bounds.size() * thetas_) {
  parallel_for(seen_.size(), [&](std::size_t row) {
    const std::size_t object = row / thetas_;
    seen_[row] = seen_tiles(reaches_[row % thetas_], space_.maps[object],
                            space_.bounds[object].levels().front());
  });
  for (std::size_t i = 0; i < space_.bounds.size(); ++i) {
    std::vector<double>& of_level = unpenalised_.emplace_back();
    for (std::size_t level = 0; level < space_.bounds[i].levels().size(); ++level) {
      of_level.push_back(space_.log_weight[i] + space_.bounds[i].best(level, elements_));
    }
  }
}

template <typename Visit>
void TileDivision::for_largest(std::size_t row, const Visit& visit) const {
  const std::size_t object = row / thetas_;
  const std::size_t theta = row % thetas_;
  const TileLevel& level = space_.bounds[object].levels().front();
  const TileRange& seen = seen_[row];
  const std::int32_t* sums = largest_.sums(object, theta);
  for (int y = seen.y_first; y < seen.y_end; ++y) {
    const std::int64_t rows = level.y.bins(y);
    const std::int32_t* of_y =
        sums + std::ptrdiff_t{y / batch_side} * level.batches_x() * batch_tiles + y % batch_side;
    for (int x = seen.x_first; x < seen.x_end; ++x) {
      const std::int64_t bins = rows * level.x.bins(x);
      if (bins > 0 && may_count(level, {.object = static_cast<std::int32_t>(object),
                                        .theta = static_cast<std::int32_t>(theta),
                                        .x = x,
                                        .y = y})) {
        visit(of_y[std::ptrdiff_t{batch_side} * x], x, y, bins);
      }
    }
  }
}

double TileDivision::bound_of(std::size_t object, std::int32_t sum) const {
  return unpenalised_[object][0] -
         static_cast<double>(largest_.unseen(object) + sum) / penalties_per_nat;
}

std::vector<Tile> TileDivision::best_of_largest() {
  constexpr double nothing = -std::numeric_limits<double>::infinity();
  std::vector<Tile> best(seen_.size(), {.bound = nothing});
  std::vector<std::int64_t> counts(seen_.size());
  parallel_for(best.size(), [&](std::size_t row) {
    std::int32_t least = std::numeric_limits<std::int32_t>::max();  // more than any sum
    Tile at{.object = static_cast<std::int32_t>(row / thetas_),
            .theta = static_cast<std::int32_t>(row % thetas_)};
    std::int64_t count = 0;
    for_largest(row, [&](std::int32_t sum, int x, int y, std::int64_t /*bins*/) {
      ++count;
      if (sum < least) {
        least = sum;
        at.x = x;
        at.y = y;
      }
    });
    counts[row] = count;
    if (count > 0) {
      at.bound = bound_of(row / thetas_, least);
      best[row] = at;
    }
  });
  bounded_ += std::accumulate(counts.begin(), counts.end(), std::int64_t{0});
  std::erase_if(best, [](const Tile& tile) { return tile.bound == nothing; });
  return best;
}

void TileDivision::count_largest(UnsettledMass& unsettled) const {
  parallel_for(space_.bounds.size(), [&](std::size_t object) {
    for (std::size_t theta = 0; theta < thetas_; ++theta) {
      for_largest(object * thetas_ + theta,
                  [&](std::int32_t sum, int /*x*/, int /*y*/, std::int64_t bins) {
                    unsettled.add(object, bound_of(object, sum), bins);
                  });
    }
  });
}

std::int64_t TileDivision::least_sum(const UnsettledMass& unsettled, std::size_t object,
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

std::vector<Tile> TileDivision::take_largest(std::span<const std::size_t> end,
                                             UnsettledMass& unsettled) const {
  std::vector<std::vector<Tile>> taken(space_.bounds.size());
  parallel_for(taken.size(), [&](std::size_t object) {
    const std::int64_t end_sum = least_sum(unsettled, object, end[object]);
    for (std::size_t theta = 0; theta < thetas_; ++theta) {
      for_largest(object * thetas_ + theta, [&](std::int32_t sum, int x, int y, std::int64_t bins) {
        if (sum < end_sum) {
          const double bound = bound_of(object, sum);
          unsettled.remove(object, bound, bins);
          taken[object].push_back(
              {bound, static_cast<std::int32_t>(object), static_cast<std::int32_t>(theta), x, y});
        }
      });
    }
  });
  return joined(taken);
}

std::vector<Tile> TileDivision::parts_of(std::span<const Tile> tiles, std::size_t level,
                                         std::vector<Tile>* unseen) {
  std::vector<std::size_t> begins;  // of tasks: tiles of one object and theta
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    if (i == 0 || tiles[i].object != tiles[i - 1].object || tiles[i].theta != tiles[i - 1].theta ||
        i - begins.back() == tiles_per_task) {
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
    const TileRange seen =
        seen_tiles(reaches_[first.theta], space_.maps[first.object], bounds.levels()[level + 1]);
    bounds.place(level + 1, space_.turns[first.theta], elements_, placed);
    parts[task].reserve((end - begins[task]) * batch_tiles);
    for (std::size_t i = begins[task]; i < end; ++i) {
      std::uint32_t sums[batch_tiles] = {};
      const int x = tiles[i].x * batch_side;
      const int y = tiles[i].y * batch_side;
      bounds.add(level + 1, elements_, placed, x, y, sums);
      append_batch(first, level + 1, x, y, sums, parts[task]);
    }
    const auto begin_unseen = std::stable_partition(
        parts[task].begin(), parts[task].end(), [&](const Tile& tile) { return seen.holds(tile); });
    if (unseen != nullptr) {
      rest[task].assign(begin_unseen, parts[task].end());
    }
    parts[task].erase(begin_unseen, parts[task].end());
  });
  if (unseen != nullptr) {
    *unseen = joined(rest);
  }
  std::vector<Tile> all = joined(parts);
  bounded_ += static_cast<std::int64_t>(all.size());
  return all;
}

void TileDivision::append_batch(const Tile& of, std::size_t level, int first_x, int first_y,
                                const std::uint32_t* sums, std::vector<Tile>& tiles) const {
  const TileLevel& tiling = space_.bounds[of.object].levels()[level];
  for (int j = 0; j < batch_side; ++j) {
    if (tiling.y.bins(first_y + j) == 0) {
      continue;
    }
    for (int i = 0; i < batch_side; ++i) {
      const Tile tile{unpenalised_[of.object][level] - sums[batch_side * i + j] / penalties_per_nat,
                      of.object, of.theta, first_x + i, first_y + j};
      if (tiling.x.bins(tile.x) > 0 && may_count(tiling, tile)) {
        tiles.push_back(tile);
      }
    }
  }
}

}  // namespace palpate
