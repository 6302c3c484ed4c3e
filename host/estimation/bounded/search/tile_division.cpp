#include "estimation/bounded/search/tile_division.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <tuple>

#include "estimation/bounded/search/item_bounds.hpp"
#include "estimation/parallel_for.hpp"

namespace palpate {

bool larger_first(const Tile& a, const Tile& b) {
  return a.bound != b.bound ? a.bound > b.bound : stands_before(a, b);
}

bool stands_before(const Tile& a, const Tile& b) {
  return std::tie(a.object, a.theta, a.y, a.x) < std::tie(b.object, b.theta, b.y, b.x);
}

void keep_best(std::vector<Tile>& tiles, std::size_t count) {
  if (tiles.size() > count) {
    std::nth_element(tiles.begin(), tiles.begin() + static_cast<std::ptrdiff_t>(count), tiles.end(),
                     larger_first);
    tiles.resize(count);
  }
}

bool is_part(const Tile& part, const Tile& of) {
  return part.object == of.object && part.theta == of.theta && part.x / batch_side == of.x &&
         part.y / batch_side == of.y;
}

TileDivision::TileDivision(const SearchTask& task, const LargestTiles& largest)
    : task_(task),
      space_(task.space),
      largest_(largest),
      thetas_(space_.turns.size()),
      reaches_(reaches_of(task.elements, space_)),
      seen_(space_.bounds.size() * thetas_),
      unpenalised_(unpenalised(space_, task.elements)),
      prior_log_likelihoods_(
          prior_log_likelihoods(task.elements, task.options.contact, space_.bounds.size())) {
  parallel_for(seen_.size(), [&](std::size_t row) {
    const std::size_t object = row / thetas_;
    seen_[row] = seen_tiles(reaches_[row % thetas_], space_.maps[object],
                            space_.bounds[object].levels().front());
  });
}

template <typename Visit>
void TileDivision::for_largest(std::size_t row, const std::int64_t& end_sum,
                               const Visit& visit) const {
  const auto object = static_cast<std::int32_t>(row / thetas_);
  const auto theta = static_cast<std::int32_t>(row % thetas_);
  const TileLevel& level = space_.bounds[object].levels().front();
  const TileRange& seen = seen_[row];
  const std::ptrdiff_t stride = std::ptrdiff_t{level.batches_x()} * batch_tiles;
  for (int y = seen.y_first; y < seen.y_end;) {
    // The sums of a batch's rows stand together, [x, y]. Most hold none that is small enough.
    const std::int32_t* sums = largest_.sums(object, theta) + y / batch_side * stride;
    std::int32_t least = std::numeric_limits<std::int32_t>::max();
    for (int i = batch_side * seen.x_first; i < batch_side * seen.x_end; ++i) {
      least = std::min(least, sums[i]);
    }
    const int y_end = std::min(seen.y_end, (y / batch_side + 1) * batch_side);
    for (; least < end_sum && y < y_end; ++y) {
      for (int x = seen.x_first; x < seen.x_end && level.y.bins(y) > 0; ++x) {
        const std::int32_t sum = sums[batch_side * x + y % batch_side];
        const Tile tile{.object = object, .theta = theta, .x = x, .y = y};
        if (sum < end_sum && level.x.bins(x) > 0) {
          visit(sum, tile);
        }
      }
    }
    y = y_end;
  }
}

std::vector<BinBox> TileDivision::off_map() const {
  std::vector<BinBox> boxes;
  for (std::size_t row = 0; row < seen_.size(); ++row) {
    const auto object = static_cast<std::int32_t>(row / thetas_);
    const auto theta = static_cast<std::int32_t>(row % thetas_);
    const TileLevel& level = space_.bounds[object].levels().front();
    const TileRange& seen = seen_[row];
    const int nx = level.x.tiles();
    for (const TileRange& tiles :
         {TileRange{0, nx, 0, seen.y_first}, TileRange{0, seen.x_first, seen.y_first, seen.y_end},
          TileRange{seen.x_end, nx, seen.y_first, seen.y_end},
          TileRange{0, nx, seen.y_end, level.y.tiles()}}) {
      boxes.push_back(level.box_of(object, theta, tiles));
    }
  }
  std::erase_if(boxes, [](const BinBox& box) { return box.bins() == 0; });
  return boxes;
}

std::vector<Tile> TileDivision::best_of_largest() {
  constexpr std::int64_t every_sum = std::numeric_limits<std::int64_t>::max();
  std::vector<Tile> best(seen_.size(), {.bound = -std::numeric_limits<double>::infinity()});
  std::vector<std::int64_t> counts(seen_.size());
  parallel_for(best.size(), [&](std::size_t row) {
    std::int64_t least = every_sum;
    for_largest(row, least, [&](std::int32_t sum, const Tile& tile) {
      least = sum;
      best[row] = tile;
      best[row].bound = bound_of_largest(row / thetas_, sum);
    });
    const TileLevel& level = space_.bounds[row / thetas_].levels().front();
    const TileRange& seen = seen_[row];
    counts[row] = level.x.tiles_with_bins(seen.x_first, seen.x_end) *
                  level.y.tiles_with_bins(seen.y_first, seen.y_end);
  });
  bounded_ += std::accumulate(counts.begin(), counts.end(), std::int64_t{0});
  std::erase_if(best, [](const Tile& tile) { return std::isinf(tile.bound); });
  return best;
}

std::vector<Tile> TileDivision::largest_above(double bound) const {
  std::vector<std::vector<Tile>> above(seen_.size());
  parallel_for(above.size(), [&](std::size_t row) {
    const std::size_t object = row / thetas_;
    const double end = (unpenalised_[object][0] - bound) * penalties_per_nat -
                       static_cast<double>(largest_.off_map(object));
    constexpr double most_sum = std::numeric_limits<std::int32_t>::max();
    const auto end_sum = static_cast<std::int64_t>(std::clamp(end, -most_sum, most_sum)) + 1;
    for_largest(row, end_sum, [&](std::int32_t sum, Tile tile) {
      tile.bound = bound_of_largest(object, sum);
      above[row].push_back(tile);
    });
  });
  std::vector<Tile> all;
  for (const std::vector<Tile>& of_row : above) {
    all.insert(all.end(), of_row.begin(), of_row.end());
  }
  return all;
}

std::vector<Tile> TileDivision::best_smallest(std::vector<Tile> tiles, std::size_t level,
                                              std::size_t width) {
  constexpr std::size_t returned = 16;
  for (; level < space_.finest_level(); ++level) {
    task_.deadline.cancel_point();
    keep_best(tiles, width);
    std::ranges::sort(tiles, stands_before);
    tiles = parts_of(tiles, level);
    width = beam_tiles;
  }
  keep_best(tiles, returned);
  return tiles;
}

std::vector<Tile> TileDivision::parts_of(std::span<const Tile> tiles, std::size_t level,
                                         std::vector<Tile>* off_map) {
  std::vector<Tile> parts;
  parts.reserve(tiles.size() * batch_tiles);
  for (std::size_t first = 0, end = 0; first < tiles.size(); first = end) {
    while (end < tiles.size() && tiles[end].object == tiles[first].object) {
      ++end;
    }
    append_parts(tiles.subspan(first, end - first), level + 1, parts, off_map);
  }
  bounded_ += static_cast<std::int64_t>(parts.size());
  return parts;
}

void TileDivision::append_parts(std::span<const Tile> tiles, std::size_t level,
                                std::vector<Tile>& parts, std::vector<Tile>* off_map) const {
  const auto object = static_cast<std::size_t>(tiles.front().object);
  const std::vector<std::int64_t> sums = sums_of_parts(tiles, level);
  const TileLevel& tiling = space_.bounds[object].levels()[level];
  TileRange seen;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    const Tile& of = tiles[i];
    if (i == 0 || of.theta != tiles[i - 1].theta) {
      seen = seen_tiles(reaches_[of.theta], space_.maps[object], tiling);
    }
    for (int row = 0; row < batch_side; ++row) {
      const int y = batch_side * of.y + row;
      for (int column = 0; column < batch_side && tiling.y.bins(y) > 0; ++column) {
        const std::int64_t penalties = sums[i * batch_tiles + batch_side * column + row];
        const Tile part{bound_of(object, level, penalties), of.object, of.theta,
                        batch_side * of.x + column, y};
        if (tiling.x.bins(part.x) == 0) {
          continue;
        }
        if (seen.holds(part)) {
          parts.push_back(part);
        } else if (off_map != nullptr) {
          off_map->push_back(part);
        }
      }
    }
  }
}

std::vector<std::int64_t> TileDivision::sums_of_parts(std::span<const Tile> tiles,
                                                      std::size_t level) const {
  std::vector<std::int64_t> sums(tiles.size() * batch_tiles);
  const auto object = static_cast<std::size_t>(tiles.front().object);
  const std::span<const KnownElements> items = task_.elements.items();
  const std::vector<std::size_t> order = sorted_touches(items);
  // Penalties that each item after the first has at least, wherever it is.
  std::vector<std::int64_t> least(items.size());
  for (const std::size_t i : std::span(order).subspan(1)) {
    const double nats =
        space_.bounds[object].best(level, items[i]) - largest_.upper_bound(i, object);
    least[i] = static_cast<std::int64_t>(std::floor(nats * penalties_per_nat));
  }
  std::int64_t rest = std::accumulate(least.begin(), least.end(), std::int64_t{0});
  std::vector<std::size_t> open(tiles.size());
  std::iota(open.begin(), open.end(), std::size_t{0});
  for (const std::size_t i : order) {
    task_.deadline.cancel_point();
    std::vector<BlockRun> batches;
    for (const std::size_t tile : open) {
      append_block(tiles[tile].theta, tiles[tile].y, tiles[tile].x, batches);
    }
    const std::vector<std::int32_t> added = penalties_of(items[i], space_, object, level, batches);
    rest -= least[i];
    auto from = added.begin();
    std::erase_if(open, [&](std::size_t tile) {
      const auto of_tile = std::span(sums).subspan(tile * batch_tiles, batch_tiles);
      std::transform(of_tile.begin(), of_tile.end(), from, of_tile.begin(), std::plus());
      from += batch_tiles;
      const std::int64_t best = rest + std::ranges::min(of_tile);
      const bool closed = bound_of(object, level, best) < negligible_;
      if (closed) {
        for (std::int64_t& sum : of_tile) {
          sum += rest;
        }
      }
      return closed;
    });
  }
  return sums;
}

}  // namespace palpate
